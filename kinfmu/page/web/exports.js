// Files to take away: the mechanism with its lengths as set, tables, drawings, and the command that builds the FMU.

import { SvgPen, THEMES } from "./pen.js";
import { draw } from "./drawing.js";
import { Spots } from "./names.js";
import { quantities, sampled } from "./plots.js";

export function download(name, text, type) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// Return the mechanism file with the values of a design; its start poses are those at the start of the run.
export function mechanismFile(linkage, design) {
    const starts = startPoses(linkage);
    return linkage.data.file.replace(/"\{\{(.+?)\}\}"/g, (_, name) => {
        if (starts.has(name)) return real(starts.get(name));
        const one = design.byName.get(name);
        const value = linkage.bound.get(name);
        return one.inFile ? `"${real(value)} ${one.inFile}"` : real(value);
    });
}

// Return the digits of a number as TOML has a float.
function real(value) {
    const text = String(value);
    return /^-?\d+$/.test(text) ? `${text}.0` : text;
}

function startPoses(linkage) {
    linkage.probe.restart();
    const pose = linkage.poseOf(linkage.probe);
    return new Map([...linkage.index].map(([name, k]) => [`start ${name}`, pose.q[k]]));
}

export function table(linkage, over) {
    const all = quantities(linkage);
    const { samples } = linkage.data;
    const { x, columns } = sampled(linkage, over, all, over === "time" && samples ? samples.t.length - 1 : undefined);
    const isAngle = over === "driver" && linkage.data.drivers[0].kind === "angle";
    const unit = over === "time" ? "s" : isAngle ? "deg" : linkage.data.unit;
    const head = [over === "time" ? (linkage.hasTime ? `time [${unit}]` : "sample") : `${linkage.data.drivers[0].inputs[0]} [${unit}]`, ...all.map((one) => `${one.id} [${one.unit}]`)];
    const lines = [head.map((text) => (text.includes(",") ? `"${text}"` : text)).join(",")];
    x.forEach((at, k) => {
        const first = isAngle ? (at * 180) / Math.PI : at;
        lines.push([first, ...columns.map((column) => (Number.isNaN(column[k]) ? "" : column[k]))].join(","));
    });
    return `${lines.join("\n")}\n`;
}

export function drawing(linkage, view, show, extra) {
    const theme = THEMES.light;
    const pen = new SvgPen(Math.round(view.width), Math.round(view.height), theme.paper);
    const spots = new Spots();
    spots.begin(0, linkage.pose, view);
    draw(pen, linkage, view, theme, show, { ...extra, pointer: null }, spots);
    return pen.svg();
}

export function buildCommand(linkage, design) {
    const file = `${linkage.data.name}.toml`;
    const note = design.changes().length ? "Save the mechanism file first: it holds the values as set." : "";
    return { command: `kinfmu build ${file} --fmi 3`, note };
}
