// The editor: a mechanism is drawn by hand in the page, by operations that the server makes edits of the mechanism file.

import { $, breakable, element } from "./elements.js";
import { linkageOf } from "./linkage.js";
import { gridOf, hit, ONE_PIN, typed } from "./editor_places.js";
import { baseOf, chosen, clicked, deletions, escaped, toolOf } from "./editor_tools.js";
import { EditorHand } from "./editor_hand.js";
import { EditorPainter } from "./editor_paint.js";
import { DrawPanel } from "./editor_panel.js";
import { buildEditor } from "./editor_parts.js";
import { OF_PICTURE, Picture } from "./editor_picture.js";
import { Session } from "./editor_session.js";
import { Sketch } from "./editor_sketch.js";

const PATIENT = 400; // [ms] before the badge states that an answer takes longer
const IDLE = 800; // [ms] without a step, before changes of a drawing that is not complete are tried
const SMALL = 0.5; // part of the view; a mechanism that takes less is fitted when it begins to move
const ELSEWHERE = 0.3; // of the size; a drawing whose edges move by more is another one
const PICTURES = ["image/png", "image/jpeg"];

export class Editor {
    constructor(page) {
        this.page = page;
        this.session = new Session((answer) => this.#take(answer));
        this.picture = new Picture();
        this.sketch = null; // until the first answer
        this.machine = null; // the tool and its clicks; null: no tool, the mechanism moves
        this.isPlayable = Boolean(page.linkage);
        this.locked = new Set(); // bodies that keep their shape
        this.chosenName = null; // { kind, ... } of what is selected
        this.marked = null; // names that are marked
        buildEditor(this);
        this.panel = new DrawPanel(this, $("draw-panel"));
        this.painter = new EditorPainter(this);
        this.hand = new EditorHand(this);
        this.#files();
    }

    get isPressed() {
        return this.hand.isPressed;
    }

    // Return whether the drawing is that of the editor, not the mechanism that moves.
    get isShown() {
        return Boolean(this.sketch && (this.machine || !this.isPlayable));
    }

    get box() {
        if (!this.isShown) return null;
        const [x0, y0, x1, y1] = this.sketch.extent();
        const least = this.sketch.data.box ? 0.1 * Math.max(x1 - x0, y1 - y0) || 50 : 0;
        return [x0 - least, y0 - least, x1 + least, y1 + least];
    }

    get unit() {
        return this.sketch.data.unit;
    }

    get step() {
        return gridOf(this.page.view.scale);
    }

    // ---- tools

    // Begin to draw, with a tool.
    async choose(id) {
        const { page } = this;
        if (!this.sketch) await this.open();
        if (page.isPlaying) page.motion.play(false);
        if (!this.machine && this.isPlayable) await this.#takeValues();
        this.machine = id in OF_PICTURE ? { tool: id, picks: [] } : chosen(id);
        if (id !== "move") this.chosenName = null;
        this.tell("");
        this.#changed();
    }

    // Leave the tools, so that the mechanism moves.
    leave() {
        if (!this.isPlayable || !this.machine) return;
        this.machine = null;
        this.#changed();
    }

    async open() {
        const answer = await this.session.load();
        if (answer.message) this.#answered(answer);
    }

    // Draw what another window or program has made: the number of the drawing's state; isFile: its file was read again.
    follow(state, isFile) {
        this.session.next(async () => {
            const before = this.session.state;
            if (!isFile && (!state || state === before)) return;
            await this.open();
            if (this.session.state !== before) this.page.hint("The drawing was changed elsewhere; this is its newer state.");
        });
    }

    // Take the values that were set while the mechanism moved into the drawing.
    async #takeValues() {
        const values = Object.fromEntries(this.page.design.changes());
        if (Object.keys(values).length) await this.operate([{ do: "values", values }]);
    }

    #changed() {
        const { page, machine } = this;
        document.body.classList.toggle("drawing", this.isShown);
        document.body.classList.toggle("still", !this.isPlayable);
        $("draw-tools").hidden = !this.sketch;
        $("draw-panel").hidden = !this.isShown;
        $("draw").setAttribute("aria-pressed", String(Boolean(machine)));
        for (const button of $("draw-tools").children) {
            const isChosen = button.dataset.tool === machine?.tool;
            if (isChosen && button.ariaPressed === "false") button.scrollIntoView({ block: "nearest", inline: "nearest" });
            button.ariaPressed = isChosen;
        }
        this.bar();
        if (this.sketch) this.panel.selected();
        page.refresh();
    }

    // Show what the tool waits for, and its choices.
    bar(refusal = "") {
        const { machine } = this;
        const tool = machine && toolOf(machine.tool);
        const hints = machine && (tool?.hints || OF_PICTURE[machine.tool]);
        const text = refusal || (hints ? hints[Math.min(machine.picks.length, hints.length - 1)] : "");
        const options = (tool?.options || []).map(([id, label]) => {
            const button = element("button", { textContent: label, "aria-pressed": String(machine.option === id) });
            button.addEventListener("click", () => {
                machine.option = id;
                this.bar();
            });
            return button;
        });
        const { selection } = this;
        if (machine?.tool === "move" && !machine.picks.length && selection) options.push(this.deleteButton(`Delete ${selection.kind === "point" ? `pin ${selection.point}` : selection.body || selection.name}`));
        const number = machine?.number ? ` Ratio ${machine.number}.` : "";
        $("draw-bar").hidden = !text;
        $("draw-bar").replaceChildren(element("p", { textContent: text + number, className: refusal ? "refused" : "", role: "status" }), ...options);
        this.hand.placeField();
    }

    // ---- operations

    get selection() {
        const { chosenName: name, sketch } = this;
        if (!name) return null;
        if (name.kind === "point") return sketch.numberOfPoint(name.point) < 0 ? null : hit(sketch, sketch.point(sketch.numberOfPoint(name.point)), ONE_PIN * sketch.size);
        if (name.kind === "body") return sketch.body(name.body) < 0 ? null : { ...name, bodies: [name.body] };
        return sketch.data[name.table].some((one) => one.name === name.name) ? name : null;
    }

    // Make operations after those that wait; return whether they were made.
    operate(operations) {
        return this.session.next(() => this.#operate(operations));
    }

    async #operate(operations) {
        this.isDrawn = true;
        const badge = $("badge");
        const before = badge.textContent;
        const waiting = setTimeout(() => (badge.textContent = "working\u2026"), PATIENT);
        const isMade = this.#answered(await this.session.operate(operations));
        clearTimeout(waiting);
        if (!isMade) badge.textContent = before;
        return isMade;
    }

    // Return whether a step of the drawing, not of values, is the next to undo or to redo.
    canUndo(isRedo) {
        const { answer } = this.session;
        const { design } = this.page;
        const isOfValues = !this.isShown && (isRedo ? design.future : design.past).length > 0;
        return Boolean(answer && !isOfValues && (isRedo ? answer.canRedo : answer.canUndo));
    }

    undo(isRedo) {
        if (this.machine) this.machine.picks = [];
        this.session.next(async () => {
            const before = this.sketch.box();
            const isMade = this.#answered(await this.session.step(isRedo ? "redo" : "undo"));
            const [x0, y0, x1, y1] = this.sketch.box();
            const apart = Math.max(...[x0, y0, x1, y1].map((x, k) => Math.abs(x - before[k])));
            if (isMade && apart > ELSEWHERE * Math.hypot(x1 - x0, y1 - y0)) this.page.fit(); // of an import
        });
    }

    save(more = {}) {
        this.session.next(async () => {
            const answer = await this.session.step("save", more);
            if (answer.status === 409 && this.session.answer.isFileChanged) this.#tellOfFile(answer.message);
            else this.#answered(answer);
        });
    }

    #tellOfFile(text) {
        this.tell(text, [["Overwrite the file", () => this.save({ force: true })], ["Take the file instead", () => this.operate([{ do: "reload" }])]]);
    }

    #answered({ status, message }) {
        if (!status) this.page.whenEnded();
        else this.tell(status === 409 ? `${message} The last step was not made; what is shown is the newer state.` : message);
        return !message;
    }

    // Show a line above the drawing, with buttons [label, act]; an empty text removes it.
    tell(text, buttons = []) {
        const line = $("draw-banner");
        line.hidden = !text;
        const made = [...buttons, ["Close", () => {}]].map(([label, act]) => {
            const button = element("button", { textContent: label });
            button.addEventListener("click", () => {
                line.hidden = true;
                act();
            });
            return button;
        });
        line.replaceChildren(element("span", { textContent: text }), ...made);
    }

    // Draw what the server answers.
    #take(answer) {
        const { page } = this;
        const isFirst = !this.sketch;
        const isOther = answer.state !== this.shownState;
        this.shownState = answer.state;
        const wasPlayable = this.isPlayable && !isFirst;
        this.sketch = new Sketch(answer.sketch);
        this.isPlayable &&= answer.badge.isComplete;
        if (!this.isPlayable) {
            if (page.isPlaying) page.motion.play(false);
            this.machine ||= chosen(answer.sketch.points.length ? "move" : "link");
        }
        this.locked = new Set([...this.locked].filter((body) => this.sketch.body(body) >= 0));
        $("name").textContent = breakable(answer.name);
        document.title = answer.name;
        const { badge } = answer;
        $("badge").textContent = badge.text + (badge.isComplete && answer.isViewComing && !this.isPlayable ? "\u2026" : "");
        $("badge").title = `Mobility ${badge.mobility ?? "unknown"}, drivers ${badge.drivers}`;
        $("badge").hidden = false;
        $("badge").classList.toggle("complete", badge.isComplete);
        $("save").disabled = answer.isSaved;
        $("save").textContent = answer.isSaved ? "Saved" : "Save";
        $("save").hidden = false;
        if (answer.isFileChanged) this.#tellOfFile("The file was changed by another program, and the drawing is not saved.");
        this.panel.update();
        this.#changed();
        if (isFirst) page.fit();
        const isKnown = isFirst && page.linkage && answer.isSaved;
        clearTimeout(this.advising);
        if (!answer.isViewComing || !isOther || isKnown) return;
        if (badge.isComplete) this.#view(wasPlayable);
        else this.advising = setTimeout(() => this.#view(wasPlayable), IDLE);
    }

    // Show the mechanism that moves, as soon as the server has it.
    async #view(wasPlayable) {
        const { page } = this;
        const found = await this.session.view();
        if (!found) return;
        if (found.findings) this.panel.findings(found.findings);
        if (!found.view) {
            if (found.message) this.panel.findings([...this.session.answer.findings, { kind: "problem", text: found.message }]);
            return;
        }
        const { state } = this.session;
        const linkage = await linkageOf(found.view, page.solver);
        if (state !== this.session.state) return;
        const { scale, x, y, isFitted } = page.view;
        page.take(linkage);
        if (this.machine) Object.assign(page.view, { scale, x, y, isFitted });
        this.isPlayable = true;
        $("badge").textContent = this.session.answer.badge.text;
        const isIdle = !this.machine?.picks.length && !this.hand.isPressed;
        if (!wasPlayable && isIdle && this.session.answer.badge.isComplete && this.isDrawn && !window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
            this.machine = null;
            const [x0, y0, x1, y1] = linkage.box();
            const part = page.view.scale * Math.max((x1 - x0) / page.view.width, (y1 - y0) / page.view.height);
            if (part < SMALL || ![[x0, y0], [x1, y1]].every((p) => this.#isInView(p))) page.fit();
            page.motion.play(true);
        }
        this.#changed();
    }

    #isInView(p) {
        const { view } = this.page;
        const [x, y] = view.pixel(p);
        return x > 0 && y > 0 && x < view.width && y < view.height;
    }

    // ---- clicks

    // Return from where lengths count, null without such a place.
    get base() {
        const { tool, picks } = this.machine;
        return tool in OF_PICTURE ? picks[picks.length - 1]?.at ?? null : baseOf(this.machine);
    }


    // Take a click, after the requests that wait: what they draw can be clicked.
    click(here) {
        return this.session.next(async () => {
            if (!this.machine) return;
            const target = this.hand.target(here);
            const isSelecting = this.machine.tool === "move" && !this.machine.picks.length && (!here.isKey || target.kind !== "point");
            if (isSelecting) this.select(target);
            else await this.#use(target);
        });
    }

    select(target) {
        const { kind, point, body, table, name } = target;
        this.chosenName = kind === "free" ? null : { kind, point, body, table, name, at: target.at };
        this.#changed();
    }

    // Give the tool a target.
    async #use(target) {
        const { machine } = this;
        if (machine.tool in OF_PICTURE) {
            this.#usePicture(target);
            return;
        }
        const { state, operations, refusal } = clicked(machine, target);
        this.machine = state;
        this.#changed();
        if (refusal) this.bar(refusal);
        if (!operations.length) return;
        this.page.view.isFitted = false; // what is drawn stays where it is, also when the window has other parts
        const isMade = await this.#operate(operations);
        if (!this.#isInView(target.at)) this.page.fit();
        if (this.machine?.tool !== state.tool) return;
        const [last] = state.picks;
        this.machine = { ...this.machine, number: null, picks: isMade && last ? [hit(this.sketch, last.at, ONE_PIN * this.sketch.size)] : [] };
        this.#changed();
    }

    #usePicture(target) {
        const { machine, picture } = this;
        machine.picks.push(target);
        const [a, b] = machine.picks;
        if (machine.tool === "shift" && b) {
            picture.move(a.at, b.at);
            this.choose("move");
        } else if (machine.picks.length > 2) machine.picks.pop();
        this.#changed();
    }

    // Take a typed text; return why it is refused.
    typed(text) {
        const { machine } = this;
        const { picks, tool } = machine;
        const base = this.base;
        const found = typed(text, tool === "scale" ? null : base, this.hand.here?.p || base);
        if (found.problem) return found.problem;
        if (tool === "scale" && picks.length === 2) {
            if (!(found.value > 0)) return "type the length between the two places";
            this.picture.scale(picks[0].at, picks[1].at, found.value);
            this.choose("move");
            return "";
        }
        const { selection } = this;
        if (tool === "move" && selection && !picks.length) return this.#typeSelected(selection, found);
        if (!found.at) {
            if (toolOf(tool)?.number) machine.number = found.value;
            else return "type x, y";
            this.bar();
            return "";
        }
        this.session.next(() => this.#use(hit(this.sketch, found.at, ONE_PIN * this.sketch.size)));
        if (this.hand.here) this.hand.here.p = found.at;
        return "";
    }

    #typeSelected(selection, found) {
        if (selection.kind === "point" && found.at) this.operate([{ do: "move", point: selection.point, to: found.at, exact: true }]);
        else if (selection.kind === "body" && found.value > 0) {
            const between = this.sketch.data.points.map((_, k) => this.sketch.nameOf(k)).filter((name) => name.split(".")[0] === selection.body).slice(0, 2);
            this.operate([{ do: "length", between, value: found.value }]);
        } else return selection.kind === "point" ? "type x, y" : "type a length";
        return "";
    }

    lock(body, isLocked) {
        if (isLocked) this.locked.add(body);
        else this.locked.delete(body);
        this.page.refresh();
    }

    // Mark what operations are about.
    mark(operations) {
        const names = operations ? JSON.stringify(operations).match(/"[^"]+"/g).map((name) => name.slice(1, -1)) : null;
        this.marked = names && new Set(names);
        this.page.refresh();
    }

    // Leave the clicks so far, then the tool.
    escape() {
        this.machine = this.machine.tool in OF_PICTURE ? chosen("move") : escaped(this.machine);
        this.chosenName = null;
        this.tell("");
        this.#changed();
    }

    deleteSelected() {
        this.operate(deletions(this.selection));
    }

    // Return a button that deletes what is selected.
    deleteButton(textContent) {
        const button = element("button", { textContent });
        button.addEventListener("click", () => this.deleteSelected());
        return button;
    }

    // Draw in place of the mechanism that moves; return whether that is the editor's.
    paint(context) {
        if (this.isShown) this.painter.paint(context);
        return this.isShown;
    }

    // ---- files and pictures

    #files() {
        document.addEventListener("dragover", (event) => event.preventDefault());
        document.addEventListener("drop", (event) => {
            event.preventDefault();
            if (event.dataTransfer.files[0]) this.takeFile(event.dataTransfer.files[0]);
        });
        document.addEventListener("paste", (event) => {
            if (event.target.closest?.("input, textarea")) return;
            const [file] = event.clipboardData.files;
            const text = event.clipboardData.getData("text");
            if (file) this.takeFile(file);
            else if (/\n|^https?:/.test(text)) this.#import(text, "");
        });
    }

    async takeFile(file) {
        if (PICTURES.includes(file.type)) await this.takePicture(file);
        else await this.#import(await file.text(), file.name);
    }

    // Take a picture; null removes it.
    async takePicture(file) {
        if (!this.machine) await this.choose("move");
        try {
            if (file) await this.picture.load(file, this.page.view);
            else this.picture.image = null;
        } catch {
            this.tell(`${file.name}: not a picture that this browser reads`);
        }
        this.panel.pictureTools.hidden = !this.picture.image;
        if (file && this.picture.image) await this.choose("scale");
        this.page.refresh();
    }

    async #import(text, name) {
        if (!this.sketch) await this.open();
        if (await this.operate([{ do: "replace", text, ...(name ? { name } : {}) }])) this.page.fit();
    }
}
