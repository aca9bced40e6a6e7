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

// Lines of commands, which continue indented on a phone.
for (const code of document.querySelectorAll(".highlight-none pre"))
    code.innerHTML = code.innerHTML.replace(/[^\n]*\n/g, (line) => `<span class="line">${line}</span>`);

// Places at which names in tables may break.
for (const name of document.querySelectorAll("td code .pre")) name.innerHTML = name.innerHTML.replace(/\w{3}[._/](?=\w{2})/g, "$&<wbr>");

// Names for readers aloud that the theme leaves out, and keys for what scrolls.
for (const button of document.querySelectorAll(".search-button-field")) button.ariaLabel = button.textContent.trim().replace(/\s+/g, " ");
for (const summary of document.querySelectorAll("summary"))
    if (!summary.textContent.trim()) summary.ariaLabel = `Pages of ${summary.parentElement.parentElement.querySelector("a").textContent.trim()}`;
for (const head of document.querySelectorAll("th")) if (!head.textContent.trim()) head.role = "presentation";
for (const wide of document.querySelectorAll(".formula, .pst-scrollable-table-container"))
    if (wide.scrollWidth > wide.clientWidth) wide.tabIndex = 0;
