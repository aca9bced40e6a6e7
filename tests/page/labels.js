// Return the controls that are shown without a name for screen readers, or without a mark when the keyboard is on them.
() => {
    const labelled = (one) => one.getAttribute("aria-labelledby")?.split(" ").map((id) => document.getElementById(id)?.textContent).join(" ");
    const name = (one) => one.getAttribute("aria-label") || labelled(one) || [...(one.labels || [])].map((label) => label.textContent).join(" ") || one.textContent;
    const controls = [...document.querySelectorAll("button, input, select, summary, [tabindex='0'], [role=tabpanel]")].filter((one) => one.checkVisibility());
    const found = [];
    for (const one of controls) {
        const what = one.id || one.outerHTML.slice(0, 80);
        if (!name(one)?.trim()) found.push(`no name: ${what}`);
        if (one.disabled || one.tabIndex < 0) continue;
        one.focus({ focusVisible: true });
        const style = getComputedStyle(one);
        if (document.activeElement !== one) found.push(`no focus: ${what}`);
        else if (!(parseFloat(style.outlineWidth) >= 2) || style.outlineStyle === "none") found.push(`focus is not seen: ${what}`);
    }
    return { found, count: controls.length };
}
