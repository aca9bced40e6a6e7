// The panels of plots, of what is shown, and of files.

import { element } from "./elements.js";
import { buildCommand, download, drawing, mechanismFile, table } from "./exports.js";
import { grouped, number } from "./numbers.js";
import { defaults, Plot, quantities, sampled } from "./plots.js";

// ---- plots

export class Plots {
    constructor(page, root) {
        this.page = page;
        this.root = root;
        this.all = quantities(page.linkage);
        this.byId = new Map(this.all.map((one) => [one.id, one]));
        this.over = page.linkage.data.drivers.length === 1 ? "driver" : "time";
        this.list = element("div", { className: "plots" });
        this.plots = [];
        const choice = element("select", { "aria-label": "Horizontal axis" });
        if (!page.linkage.data.over) choice.append(element("option", { value: "time", textContent: page.linkage.hasTime ? "time" : "sample" }));
        if (this.over === "driver") choice.prepend(element("option", { value: "driver", textContent: page.linkage.data.drivers[0].name }));
        choice.value = this.over;
        choice.addEventListener("change", () => {
            this.over = choice.value;
            this.refresh();
        });
        const add = element("button", { textContent: "Add a plot" });
        add.addEventListener("click", () => this.add(this.all[this.plots.length % this.all.length].id));
        const over = element("label", { className: "row" }, element("span", { className: "label", textContent: "Over" }), choice);
        root.append(over, this.list, add, element("p", { className: "quiet", textContent: "Click or drag in a plot to move the mechanism there." }));
        defaults(page.linkage, this.all).forEach((id) => this.add(id));
    }

    add(id) {
        const select = element("select", { "aria-label": "Quantity" });
        for (const [name, members] of grouped(this.all, (one) => one.group)) {
            const group = element("optgroup", { label: name });
            members.forEach((one) => group.append(element("option", { value: one.id, textContent: `${one.label} [${one.unit}]` })));
            select.append(group);
        }
        select.value = id;
        const value = element("span", { className: "reading" }); // no <output>: screen readers would speak it in each frame
        const remove = element("button", { textContent: "\u00d7", title: "Remove the plot", "aria-label": "Remove the plot" });
        const canvas = element("canvas", { tabIndex: 0, role: "img" });
        const card = element("div", { className: "plot" }, element("div", { className: "head" }, select, value, remove), canvas);
        const plot = { select, value, canvas, painter: new Plot(canvas, (x) => this.page.pick(this.over, x)) };
        select.addEventListener("change", () => this.refresh());
        remove.addEventListener("click", () => {
            this.plots.splice(this.plots.indexOf(plot), 1);
            card.remove();
        });
        this.plots.push(plot);
        this.list.append(card);
        this.refresh();
    }

    get isShown() {
        return !this.root.hidden && this.plots.length > 0;
    }

    // Compute the curves again, after lengths have changed.
    refresh() {
        this.table = null;
        this.draw();
    }

    draw() {
        if (!this.isShown) return;
        const { linkage, theme } = this.page;
        const wanted = this.plots.map((plot) => this.byId.get(plot.select.value));
        this.table ||= sampled(linkage, this.over, wanted);
        const driver = linkage.data.drivers[0];
        const isAngle = this.over === "driver" && driver.kind === "angle";
        const cursor = this.over === "time" ? linkage.t : linkage.wrapped(0);
        this.plots.forEach((plot, k) => {
            const one = wanted[k];
            const now = one.read(linkage, linkage.pose);
            plot.value.textContent = `${number(now)} ${one.unit}`;
            const xLabel = this.over === "time" ? (linkage.hasTime ? "s" : "") : isAngle ? "" : linkage.data.unit;
            plot.painter.draw({ x: this.table.x, values: this.table.columns[k], label: one.label, unit: one.unit, cursor, now, theme, isAngle, xLabel, isPlaying: this.page.isPlaying });
        });
    }
}

// ---- what is shown, files

export function showPanel(page, root) {
    const has = page.linkage.data;
    const { undetermined, externals } = page.linkage.part;
    const rows = [
        ["names", "Names", ""],
        ["curves", "Curves of the points of interest", ""],
        ["traces", "Trace while it moves", "the last 600 places of each drawn point"],
        ["velocity", "Velocities", ""],
        ["acceleration", "Accelerations", ""],
        ...(has.loops.length ? [["transmission", "Transmission angle", "red below 40\u00b0 or above 140\u00b0"]] : []),
        ["centres", "Instant centres", "1 is the ground, then the bodies in the order of the file"],
        ["limits", "Limits and change points", "on the circle of the driver"],
        ...(page.linkage.part.reactions.length ? [["forces", "Forces in the joints", `of the first body on the second${undetermined.length ? `; undetermined: ${undetermined.join(", ")}` : ""}`], ["shaking", "Shaking force", "on the ground, drawn at its origin"]] : []),
        ...(has.loads.length || has.gravity ? [["loads", "Loads and gravity", "springs, dampers, forces and torques; arrows are not to scale"]] : []),
        ["grid", "Grid", ""],
    ];
    for (const [key, label, note] of rows) {
        const box = element("input", { type: "checkbox", checked: page.show[key], id: `show-${key}` });
        box.addEventListener("change", () => {
            page.show[key] = box.checked;
            page.refresh();
        });
        const text = element("span", { textContent: label });
        if (note) text.append(element("small", { textContent: note }));
        root.append(element("label", { className: "check" }, box, text));
    }
    for (const text of has.unknownContacts) root.append(element("p", { className: "quiet", textContent: `${text}.` }));
    if (externals.length) root.append(element("p", { className: "quiet", textContent: `Loads from outside are 0 in this page: ${externals.join(", ")}.` }));
    if (page.linkage.bodies.length <= 13) {
        const numbers = page.linkage.bodies.map((name, k) => `${k + 1} ${name}`).join(", ");
        root.append(element("p", { className: "quiet", textContent: `Bodies: ${numbers}.` }));
    }
    root.append(element("p", { className: "quiet", textContent: "Double-click a point of the drawing to draw its curve." }));
}

export function filesPanel(page, root) {
    const { linkage, design } = page;
    const name = linkage.data.name;
    const buttons = element("div", { className: "buttons" });
    const add = (label, id, act) => {
        const button = element("button", { textContent: label, id });
        button.addEventListener("click", act);
        buttons.append(button);
    };
    add("Mechanism file with the values as set (TOML)", "save-file", () => download(`${name}.toml`, mechanismFile(linkage, design), "application/toml"));
    if (linkage.data.drivers.length === 1) add(`Table over ${linkage.data.drivers[0].name} (CSV)`, "save-driver", () => download(`${name}.csv`, table(linkage, "driver"), "text/csv"));
    if (!linkage.data.over) add(`Table over ${linkage.hasTime ? "time" : "the samples"} (CSV)`, "save-time", () => download(`${name}.csv`, table(linkage, "time"), "text/csv"));
    add("Drawing as shown (SVG)", "save-svg", () => download(`${name}.svg`, drawing(linkage, page.view, page.show, page.extra()), "image/svg+xml"));
    root.append(element("h2", { textContent: "Save" }), buttons);
    const { command } = buildCommand(linkage, design);
    const code = element("code", { textContent: command, tabIndex: 0 });
    root.append(
        element("h2", { textContent: "Build the FMU" }),
        element("p", { className: "quiet", textContent: "Save the mechanism file, then type in its folder:" }),
        element("div", { className: "command" }, code, copyButton(() => command)),
        element("h2", { textContent: "Link to this design", style: "margin-top: 18px" }),
        element("p", { className: "quiet", textContent: "The address of this page holds the values and the pose." }),
        element("div", { className: "command" }, copyButton(() => location.href, "Copy the address")),
    );
    const notes = linkage.data.notes;
    if (notes.length) root.append(element("h2", { textContent: "Notes of kinfmu check", style: "margin-top: 18px" }), ...notes.map((note) => element("p", { className: "quiet", textContent: note })));
    root.append(element("p", { className: "quiet", style: "margin-top: 18px", textContent: `Computed by kinfmu ${linkage.data.version}, with the code of its FMU. This page works offline.` }));
}

function copyButton(text, label = "Copy") {
    const button = element("button", { textContent: label });
    button.addEventListener("click", async () => {
        try {
            await navigator.clipboard.writeText(text());
            button.textContent = "Copied";
        } catch {
            button.textContent = "Select and copy";
        }
        setTimeout(() => (button.textContent = label), 1500);
    });
    return button;
}
