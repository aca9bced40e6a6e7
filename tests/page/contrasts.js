// Return the contrast of each element with text, and the least that WCAG AA allows for its size.
() => {
    const numbers = (colour) => colour.match(/[\d.]+/g).map(Number);
    const light = (rgb) => {
        const [r, g, b] = rgb.slice(0, 3).map((v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const behind = (one) => {
        const back = numbers(getComputedStyle(one).backgroundColor);
        return back.length < 4 || back[3] > 0 || !one.parentElement ? back : behind(one.parentElement);
    };
    const hasText = (one) => one.value !== undefined ? one.type !== "range" : [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
    const shown = [...document.body.querySelectorAll("*")].filter((one) => one.checkVisibility() && !one.disabled && hasText(one));
    return shown.map((one) => {
        const style = getComputedStyle(one);
        const [a, b] = [light(numbers(style.color)), light(behind(one))];
        const size = parseFloat(style.fontSize);
        const least = size >= 24 || (size >= 18.66 && style.fontWeight >= 700) ? 3 : 4.5;
        return { name: one.id || one.className || one.tagName, ratio: (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), least };
    });
}
