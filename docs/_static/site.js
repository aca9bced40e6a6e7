// A button on each block of code that copies it.
for (const code of document.querySelectorAll("article pre")) {
    const button = document.createElement("button");
    button.textContent = "Copy";
    button.addEventListener("click", async () => {
        await navigator.clipboard.writeText(code.textContent.trimEnd());
        button.textContent = "Copied";
        setTimeout(() => (button.textContent = "Copy"), 1500);
    });
    code.parentElement.classList.add("copied");
    code.after(button);
}
