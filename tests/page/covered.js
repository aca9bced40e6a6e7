// Return which names of an SVG drawing cover each other, or a link, bar or cylinder: lines of at least 4 px.
(text) => {
    const box = document.createElement("div");
    box.style.cssText = "position: absolute; left: 0; top: 0; visibility: hidden";
    box.innerHTML = text;
    document.body.append(box);
    const svg = box.querySelector("svg");
    const names = [...svg.querySelectorAll("text")].map((one) => ({ name: one.textContent, box: one.getBBox() }));
    const bars = [...svg.querySelectorAll("path")].filter((one) => Number(one.getAttribute("stroke-width")) >= 4);
    const place = svg.createSVGPoint();
    const isOn = (bar, x, y) => {
        [place.x, place.y] = [x, y];
        return bar.isPointInStroke(place);
    };
    const found = [];
    names.forEach(({ name, box: a }, k) => {
        for (const { name: other, box: b } of names.slice(k + 1)) {
            if (a.x < b.x + b.width && b.x < a.x + a.width && a.y + 2 < b.y + b.height - 2 && b.y + 2 < a.y + a.height - 2) found.push(`${name} on ${other}`);
        }
        const along = Array.from({ length: 21 }, (_, i) => a.x + (a.width * i) / 20);
        const up = [0.2, 0.35, 0.5, 0.65, 0.8].map((part) => a.y + a.height * part);
        if (bars.some((bar) => along.some((x) => up.some((y) => isOn(bar, x, y))))) found.push(`${name} on the linkage`);
    });
    box.remove();
    return { found, count: names.length };
}
