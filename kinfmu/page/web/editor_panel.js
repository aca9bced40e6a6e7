// The panel of the editor: findings with their edits, what is selected, the mechanism, the picture behind, the file.

import { distance } from "./geometry.js";
import { element } from "./elements.js";
import { number } from "./numbers.js";
import { GROUND } from "./editor_places.js";

const UNITS = ["mm", "cm", "m", "in"];
const KINDS = { problem: "Problem", open: "Not complete", note: "Note", ok: "" };

export class DrawPanel {
    constructor(editor, root) {
        this.editor = editor;
        this.root = root;
        this.parts = Object.fromEntries(["findings", "selected", "mechanism", "picture", "file"].map((name) => [name, element("section", { className: name })]));
        const { findings, selected, ...more } = this.parts;
        const isOpen = window.matchMedia("(min-width: 821px)").matches;
        root.append(findings, selected, element("details", { open: isOpen }, element("summary", { textContent: "Mechanism, picture, file" }), ...Object.values(more)));
        this.#picture();
    }

    update() {
        const { answer } = this.editor.session;
        this.findings(answer.findings);
        this.selected();
        this.#mechanism(answer);
        this.#file(answer);
    }

    // Show findings, each with buttons that apply its edits; what they are about is marked while one is pointed at.
    findings(all) {
        const { editor } = this;
        this.parts.findings.replaceChildren(...all.map(({ kind, text, edits }) => {
            const buttons = (edits || []).map((edit) => {
                const button = element("button", { textContent: edit.text, className: "ghost" });
                button.addEventListener("click", () => {
                    editor.mark(null);
                    editor.operate(edit.operations);
                });
                for (const [begin, end] of [["pointerenter", "pointerleave"], ["focus", "blur"]]) {
                    button.addEventListener(begin, () => editor.mark(edit.operations));
                    button.addEventListener(end, () => editor.mark(null));
                }
                return button;
            });
            const head = KINDS[kind] ? [element("b", { textContent: `${KINDS[kind]}: ` })] : [];
            return element("div", { className: `finding ${kind}` }, element("p", {}, ...head, text), ...(buttons.length ? [element("div", { className: "edits" }, ...buttons)] : []));
        }));
    }

    // Show what is selected: its names and lengths, and what can be done with it.
    selected() {
        const { editor, parts: { selected } } = this;
        const target = editor.selection;
        if (!target) {
            selected.replaceChildren();
            return;
        }
        const isPin = target.kind === "point";
        const bodies = (isPin ? target.bodies : [target.body]).filter((body) => body !== GROUND);
        const rows = [element("h2", { textContent: isPin ? `Pin ${target.point}` : target.kind === "member" ? target.name : `Link ${target.body}` })];
        if (isPin) rows.push(this.#field("Place", `${number(target.at[0], 9)}, ${number(target.at[1], 9)}`, editor.unit, (text) => editor.typed(text)));
        if (target.kind === "body") rows.push(...this.#body(target.body));
        if (isPin && target.points.length > 1) rows.push(element("p", { className: "quiet", textContent: `Points: ${target.points.join(", ")}` }));
        for (const { name, place } of this.#members(target, bodies)) rows.push(this.#member(name, place));
        rows.push(element("div", { className: "edits" }, editor.deleteButton("Delete")));
        selected.replaceChildren(...rows);
    }

    #body(body) {
        const { editor } = this;
        const { sketch } = editor;
        const own = sketch.data.points.map((_, k) => k).filter((k) => sketch.data.points[k].body === body);
        const rows = [this.#field("Name", body, "", (name) => editor.operate([{ do: "rename", place: ["bodies", body], name }]))];
        own.slice(1).forEach((k) => {
            const between = [own[0], k].map((one) => sketch.nameOf(one));
            const label = between.map((name) => name.split(".")[1]).join("\u2013");
            const length = distance(sketch.point(own[0]), sketch.point(k));
            rows.push(this.#field(`Length ${label}`, number(length, 9), editor.unit, (text) => editor.operate([{ do: "length", between, value: Number(text) }])));
        });
        const box = element("input", { type: "checkbox", checked: editor.locked.has(body) });
        box.addEventListener("change", () => editor.lock(body, box.checked));
        return [...rows, element("label", { className: "check" }, box, element("span", { textContent: "Keep its lengths while pins are dragged" }))];
    }

    // Return the joints, drivers, loads and points of interest of what is selected: { name, place }.
    #members(target, bodies) {
        const { data } = this.editor.sketch;
        const isBody = target.kind === "body";
        const numbers = data.points.map((_, k) => k).filter((k) => (isBody ? data.points[k].body === target.body : target.points?.includes(this.editor.sketch.nameOf(k))));
        const drawn = new Set(data.shapes.filter(({ frame }) => isBody && frame === target.body).map(({ name }) => name)); // as gears and cams
        const isHere = (one) => one.points?.some((k) => numbers.includes(k)) || drawn.has(one.name) || (isBody && (one.body === target.body || one.frame === target.body));
        const drivers = data.drivers.filter((one) => isHere(one) || (target.kind === "point" && bodies.includes(one.body)));
        const kind = ({ type, points = [] }, table) => [type.replaceAll("_", " "), ...(table === "joints" && points.length ? [points.map((k) => data.points[k].body).join("\u2013")] : [])].join(", ");
        return [["joints", data.joints.filter(isHere)], ["drivers", drivers], ["loads", data.loads.filter(isHere)], ["points", data.interest.filter(({ point }) => numbers.includes(point)).map(({ name }) => ({ name, type: "of interest" }))]].flatMap(([table, all]) => all.map((one) => ({ name: `${one.name} (${kind(one, table)})`, place: [table, one.name] })));
    }

    #member(name, place) {
        const remove = element("button", { textContent: "\u00d7", title: `Delete ${name}`, "aria-label": `Delete ${name}` });
        remove.addEventListener("click", () => this.editor.operate([{ do: "delete", place }]));
        return element("div", { className: "row" }, element("span", { className: "wide", textContent: name }), remove);
    }

    #field(label, value, unit, take) {
        const field = element("input", { type: "text", value, "aria-label": label });
        field.addEventListener("change", () => take(field.value));
        return element("label", { className: "row" }, element("span", { className: "label", textContent: label }), field, element("span", { className: "unit", textContent: unit }));
    }

    #mechanism(answer) {
        const { editor } = this;
        const units = element("select", { "aria-label": "Unit of length" }, ...UNITS.map((unit) => element("option", { value: unit, textContent: unit })));
        units.value = editor.unit;
        units.addEventListener("change", () => editor.operate([{ do: "units", length: units.value }]));
        const name = this.#field("Name", answer.name, "", (text) => editor.operate([{ do: "name", name: text }]));
        this.parts.mechanism.replaceChildren(element("h2", { textContent: "Mechanism" }), name, element("label", { className: "row" }, element("span", { className: "label", textContent: "Unit" }), units));
    }

    #picture() {
        const { editor } = this;
        const { picture } = editor;
        const file = element("input", { type: "file", accept: "image/png,image/jpeg", hidden: true, id: "picture-file" });
        file.addEventListener("change", () => file.files[0] && editor.takePicture(file.files[0]));
        const alpha = element("input", { type: "range", min: 0.1, max: 1, step: "any", value: picture.alpha, "aria-label": "Opacity of the picture" });
        alpha.addEventListener("input", () => {
            picture.alpha = Number(alpha.value);
            editor.page.refresh();
        });
        const add = (label, act) => {
            const button = element("button", { textContent: label });
            button.addEventListener("click", act);
            return button;
        };
        const choose = add("Choose a picture", () => file.click());
        const tools = element("div", { className: "edits", hidden: true, id: "picture-tools" }, add("Scale it", () => editor.choose("scale")), add("Move it", () => editor.choose("shift")), add("Remove it", () => editor.takePicture(null)), alpha);
        this.pictureTools = tools;
        this.parts.picture.append(element("h2", { textContent: "Picture behind" }), element("p", { className: "quiet", textContent: "A photograph or drawing (PNG, JPEG) to draw on: choose, drop or paste it. It stays in this page." }), file, choose, tools);
    }

    #file(answer) {
        const isOpen = this.parts.file.querySelector("details")?.open;
        const file = element("input", { type: "file", hidden: true, id: "import-file" });
        file.addEventListener("change", () => file.files[0] && this.editor.takeFile(file.files[0]));
        const choose = element("button", { textContent: "Import a file in its place" });
        choose.addEventListener("click", () => file.click());
        const text = element("details", { open: Boolean(isOpen) }, element("summary", { textContent: "Its text (TOML)" }), element("pre", { textContent: answer.text, tabIndex: 0 }));
        this.parts.file.replaceChildren(element("h2", { textContent: "File" }), element("p", { className: "quiet", textContent: "A mechanism file, or one of Linkage, PMKS+ or DXF, can also be dropped on the drawing; text and links can be pasted." }), file, choose, text);
    }
}
