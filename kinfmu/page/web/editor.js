// The editor: a mechanism is drawn by hand in the page, by operations that the server makes edits of the mechanism file.

import { draw } from "./drawing.js";
import { $, breakable, element } from "./elements.js";
import { distance, placed } from "./geometry.js";
import { linkageOf } from "./linkage.js";
import { CanvasPen, css, GREY, edgeOf, fillOf } from "./pen.js";
import { Spots } from "./names.js";
import { clean, gridOf, GROUND, hit, kept, measured, ONE_PIN, snapped, typed } from "./editor_places.js";
import { baseOf, chosen, clicked, deletions, escaped, toolOf, TOOLS } from "./editor_tools.js";
import { DrawPanel } from "./editor_panel.js";
import { Picture } from "./editor_picture.js";
import { Session } from "./editor_session.js";
import { EMPTY_BOX, Sketch } from "./editor_sketch.js";

const ICONS = {
    move: '<path d="M5 3l10 7-5 1-2 5z"/>',
    link: '<circle cx="4.5" cy="15.5" r="2.3"/><circle cx="15.5" cy="4.5" r="2.3"/><path d="M6.2 13.8 13.8 6.2"/>',
    pin: '<path d="M2.5 16 8 11.5M17.5 16 12 11.5"/><circle cx="10" cy="9.5" r="2.8"/>',
    ground: '<path d="M10 3.5 5 12h10zM2.5 12h15M5 16l2-4M9.5 16l2-4M14 16l2-4"/>',
    motor: '<path d="M4.2 12.5a6.3 6.3 0 1 1 4 3.6M2.5 9.5l1.6 3.2L7.2 11"/><circle class="full" cx="10" cy="10" r="1.5"/>',
    slider: '<rect x="5.5" y="5" width="9" height="6.5" rx="1"/><path d="M2 14h16M4 17l2-3M9 17l2-3M14 17l2-3"/>',
    slot: '<rect x="2" y="6.5" width="16" height="7" rx="3.5"/><circle cx="7.5" cy="10" r="1.8"/>',
    cylinder: '<path d="M2.5 6.5H12v7H2.5zM12 10h6"/>',
    gear: '<circle cx="7" cy="11" r="4.6" stroke-dasharray="2.2 1.2"/><circle cx="14.8" cy="7" r="3.2" stroke-dasharray="2 1"/>',
    cam: '<path d="M8.5 4.5c5.5 0 9 3 9 6s-3.5 5.5-9 5.5a5.7 5.7 0 0 1 0-11.5z"/><circle class="full" cx="8" cy="10.3" r="1.3"/>',
    spring: '<path d="M1.5 10h3L6 5.5l3 9 3-9 3 9 1-4.5h2.5"/>',
    force: '<path d="M3.5 16.5 16 4M9.5 4H16v6.5"/>',
    interest: '<circle class="full" cx="10" cy="10" r="2.4"/><path d="M10 2v4M10 14v4M2 10h4M14 10h4"/>',
    delete: '<path d="M5 5l10 10M15 5 5 15"/>',
};
const PEN = '<svg viewBox="0 0 20 20"><path d="M3 17l1-4L14 3l3 3L7 16zM12 5l3 3"/></svg>';
const CLICK = 7; // [px] that the pointer may move in a click
const PALE = 0.62; // of what is half-drawn
const PICTURES = ["image/png", "image/jpeg"];
const OF_PICTURE = { scale: ["Click one end of a known length in the picture.", "Click its other end.", "Type this length."], shift: ["Click a place of the picture.", "Click where it belongs."] };
const KEYS = [
    ["A letter, or <kbd>Tab</kbd> to a button", `chooses a tool: ${TOOLS.map(({ key, label }) => `<kbd>${key.toUpperCase()}</kbd> ${label.toLowerCase()}`).join(", ")}`],
    ["Arrow keys, <kbd>Enter</kbd>", "move a cursor on the grid, with <kbd>Shift</kbd> ten times as far; click there"],
    ["Digits", "type a length, a length &lt; angle in degrees, or x, y; <kbd>Enter</kbd> accepts it"],
    ["<kbd>Alt</kbd>, <kbd>Shift</kbd> with a click", "nothing snaps; links snap to steps of 15\u00b0"],
    ["<kbd>Esc</kbd>", "leaves a link half-way, then the tool"],
    ["<kbd>Space</kbd>, <kbd>V</kbd>", "play the mechanism; draw again"],
    ["<kbd>Del</kbd>, <kbd>Ctrl</kbd>+<kbd>S</kbd>, <kbd>Home</kbd>", "delete what is selected, save, fit to view"],
    ["Middle button, or two fingers", "move the view"],
];

export class Editor {
    constructor(page) {
        this.page = page;
        this.session = new Session((answer) => this.#take(answer));
        this.picture = new Picture();
        this.sketch = null; // until the first answer
        this.machine = null; // the tool and its clicks; null: no tool, the mechanism moves
        this.isPlayable = Boolean(page.linkage);
        this.isPressed = false;
        this.pressed = null; // { p, at, target } where the pointer went down
        this.here = null; // { p, isKey, isFree, isAngled, reach } the pointer, or the cursor that keys move
        this.locked = new Set(); // bodies that keep their shape
        this.chosenName = null; // { kind, ... } of what is selected
        this.marked = null; // names that are marked
        this.spots = new Spots();
        this.layer = new OffscreenCanvas(1, 1); // of what is drawn lighter
        this.#build();
        this.#pointer();
        this.#keys();
        this.#files();
    }

    // Return whether the drawing is that of the editor, not the mechanism that moves.
    get isShown() {
        return Boolean(this.sketch && (this.machine || !this.isPlayable));
    }

    get box() {
        if (!this.isShown) return null;
        const [x0, y0, x1, y1] = this.sketch.box();
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
        const { message } = await this.session.load();
        if (message) this.tell(message);
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
        this.#bar();
        if (this.sketch) this.panel.selected();
        page.refresh();
    }

    // Show what the tool waits for, and its choices.
    #bar(refusal = "") {
        const { machine } = this;
        const tool = machine && toolOf(machine.tool);
        const hints = machine && (tool?.hints || OF_PICTURE[machine.tool]);
        const text = refusal || (hints ? hints[Math.min(machine.picks.length, hints.length - 1)] : "");
        const options = (tool?.options || []).map(([id, label]) => {
            const button = element("button", { textContent: label, "aria-pressed": String(machine.option === id) });
            button.addEventListener("click", () => {
                machine.option = id;
                this.#bar();
            });
            return button;
        });
        const number = machine?.number ? ` Ratio ${machine.number}.` : "";
        $("draw-bar").hidden = !text;
        $("draw-bar").replaceChildren(element("p", { textContent: text + number, className: refusal ? "refused" : "", role: "status" }), ...options);
        this.#placeField();
    }

    // ---- operations

    get selection() {
        const { chosenName: name, sketch } = this;
        if (!name) return null;
        if (name.kind === "point") return sketch.numberOfPoint(name.point) < 0 ? null : hit(sketch, sketch.point(sketch.numberOfPoint(name.point)), ONE_PIN * sketch.size);
        if (name.kind === "body") return sketch.body(name.body) < 0 ? null : { ...name, bodies: [name.body] };
        return sketch.lines.some((line) => line.table === name.table && line.name === name.name) ? name : null;
    }

    // Make operations after those that wait; return whether they were made.
    operate(operations) {
        return this.session.next(() => this.#operate(operations));
    }

    async #operate(operations) {
        this.isDrawn = true;
        return this.#answered(await this.session.operate(operations));
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
        this.session.next(async () => this.#answered(await this.session.step(isRedo ? "redo" : "undo")));
    }

    save(more = {}) {
        this.session.next(async () => {
            const { status, message } = await this.session.step("save", more);
            if (status === 409) this.tell(message, [["Overwrite the file", () => this.save({ force: true })], ["Take the file instead", () => this.operate([{ do: "reload" }])]]);
            else this.tell(message);
        });
    }

    #answered({ status, message }) {
        this.tell(status === 409 ? `${message} The last step was not made; what is shown is the newer state.` : message);
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
        $("badge").textContent = badge.text + (answer.isViewComing && !this.isPlayable ? "\u2026" : "");
        $("badge").title = `Mobility ${badge.mobility ?? "unknown"}, drivers ${badge.drivers}`;
        $("badge").hidden = false;
        $("badge").classList.toggle("complete", badge.isComplete);
        $("save").disabled = answer.isSaved;
        $("save").textContent = answer.isSaved ? "Saved" : "Save";
        $("save").hidden = false;
        if (answer.isFileChanged) this.tell("Another program wrote the file while changes here are not saved.", [["Take the file", () => this.operate([{ do: "reload" }])]]);
        this.panel.update();
        this.#changed();
        if (isFirst) page.fit();
        const isKnown = isFirst && page.linkage && answer.isSaved;
        if (answer.isViewComing && isOther && !isKnown) this.#view(wasPlayable);
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
        const isIdle = !this.machine?.picks.length && !this.isPressed;
        if (!wasPlayable && isIdle && this.session.answer.badge.isComplete && this.isDrawn && !window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
            this.machine = null;
            const [x0, y0, x1, y1] = linkage.box();
            if (![[x0, y0], [x1, y1]].every((p) => this.#isInView(p))) page.fit();
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

    // Return the target of a click at what the pointer or cursor is.
    #target(here = this.here) {
        const { machine } = this;
        const tool = toolOf(machine.tool);
        const options = { reach: here.reach, step: this.step, base: this.base, isFree: here.isFree || machine.tool in OF_PICTURE, isAngled: here.isAngled, hasMembers: tool?.hasMembers || (machine.tool === "move" && !machine.picks.length) };
        return snapped(this.sketch, here.p, options);
    }

    // Take a click, after the requests that wait: what they draw can be clicked.
    click(here) {
        return this.session.next(async () => {
            if (!this.machine) return;
            const target = this.#target(here);
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
        if (refusal) this.#bar(refusal);
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
        const found = typed(text, tool === "scale" ? null : base, this.here?.p || base);
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
            this.#bar();
            return "";
        }
        this.session.next(() => this.#use(hit(this.sketch, found.at, ONE_PIN * this.sketch.size)));
        if (this.here) this.here.p = found.at;
        return "";
    }

    #typeSelected(selection, found) {
        if (selection.kind === "point" && found.at) this.operate([{ do: "move", point: selection.point, to: found.at }]);
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

    // ---- painting

    paint(context) {
        if (!this.isShown) return false;
        const { page, sketch } = this;
        const { view, theme } = page;
        const pen = new CanvasPen(context);
        this.picture.paint(context, view);
        const show = { names: true, loads: true };
        const extra = { curves: [], arrows: [], legend: [], held: null, isGhost: false };
        const nothing = new Sketch({ ...sketch.data, bodies: sketch.data.bodies.slice(0, 1), points: [], joints: [], drivers: [], shapes: [], loads: [], interest: [], cams: [], gravity: null });
        draw(pen, nothing, view, theme, { grid: true }, extra, this.spots);
        this.spots.begin(page.now, sketch.pose, view);
        const shown = this.#dragged() || sketch;
        const layer = this.session.answer.badge.isComplete ? null : this.layer;
        const target = layer ? layer.getContext("2d") : context;
        if (layer) {
            [layer.width, layer.height] = [context.canvas.width, context.canvas.height]; // and without what was drawn before
            target.setTransform(context.getTransform());
        }
        draw(new CanvasPen(target), shown, view, theme, show, extra, this.spots);
        this.#marks(new CanvasPen(target), shown);
        if (layer) {
            context.save();
            context.resetTransform();
            context.globalAlpha = PALE;
            context.drawImage(layer, 0, 0);
            context.restore();
        }
        this.#highlights(pen, shown);
        if (this.machine) this.#preview(pen, shown);
        [page.handles, page.hasHidden] = [[], false];
        if (this.isPlayable) page.transport.update();
        [$("undo").disabled, $("redo").disabled] = [!this.canUndo(false), !this.canUndo(true)];
        return true;
    }

    // Return the sketch with the pin where it is dragged to; null while none is.
    #dragged() {
        const drag = this.#drag();
        return drag && this.sketch.moved(drag.number, drag.to);
    }

    // Return the pin that is moved, where to, and the operations; on another pin it is pinned to that.
    #drag() {
        const { machine, pressed, here, sketch } = this;
        if (machine?.tool !== "move" || !here) return null;
        const pin = machine.picks[0] || (pressed?.isMoved && pressed.target.kind === "point" && pressed.target);
        if (!pin) return null;
        const number = sketch.numberOfPoint(pin.point);
        if (number < 0) return null;
        const own = new Set(sketch.movingWith(number));
        const over = snapped({ ...sketch, pins: sketch.pins.filter((one) => !one.points.some((k) => own.has(k))), lines: [], areas: [], nameOf: (k) => sketch.nameOf(k), heldWith: (k) => sketch.heldWith(k) }, here.p, { reach: here.reach, step: this.step, isFree: here.isFree });
        const to = kept(sketch.point(number), over.at, sketch.placesKept(number, this.locked));
        const target = distance(to, over.at) ? { kind: "free", at: to } : over;
        return { number, to, operations: toolOf("move").make([pin, target]) };
    }

    // Draw points that no joint holds, places on the ground without a joint, motors and locks.
    #marks(pen, sketch) {
        const { view, theme } = this.page;
        const { data } = sketch;
        const size = Math.max(2.4, 0.33 * Math.max(4, Math.min(15, 13 * sketch.fineness)));
        const used = new Set(data.joints.flatMap((joint) => joint.points || []));
        const supports = (sketch.shapesOf.get("support") || []).map(({ frame, points }) => placed(sketch.bodyPose(sketch.body(frame)), ...points[0]));
        for (const { at, points } of sketch.pins) {
            if (points.some((k) => used.has(k))) continue;
            const [x, y] = view.pixel(at);
            const isSupported = supports.some((p) => distance(p, at) < ONE_PIN * sketch.size);
            if (!isSupported && points.some((k) => data.points[k].body === GROUND)) {
                const colour = edgeOf(GREY, theme);
                pen.line([[x, y], [x - 10, y + 17], [x + 10, y + 17]], { width: 1.3, colour, fill: fillOf(GREY, theme), closed: true });
                pen.line([[x - 15, y + 17], [x + 15, y + 17]], { width: 1.6, colour });
            }
            pen.circle(x, y, size, { width: 1.6, colour: theme.ink, fill: theme.paper });
        }
        for (const driver of data.drivers) if (driver.kind === "angle") this.#motor(pen, sketch, driver);
        for (const body of this.locked) {
            const line = sketch.lines.find((one) => one.body === body);
            if (line) lock(pen, view.pixel([0, 1].map((k) => 0.7 * line.ends[0][k] + 0.3 * line.ends[1][k])), theme);
        }
    }

    #motor(pen, sketch, { pivot, body }) {
        const { view, theme } = this.page;
        const own = sketch.data.points.findIndex((point) => point.body === body);
        const number = pivot ?? own;
        if (number < 0) return;
        const [x, y] = view.pixel(sketch.point(number));
        const arc = Array.from({ length: 25 }, (_, k) => -0.5 + (4.4 * k) / 24).map((angle) => [x + 19 * Math.cos(angle), y - 19 * Math.sin(angle)]);
        pen.line(arc, { width: 2.2, colour: theme.accent });
        const [tip, before] = [arc[24], arc[21]];
        const [dx, dy] = [(tip[0] - before[0]) / distance(tip, before), (tip[1] - before[1]) / distance(tip, before)];
        pen.line([[tip[0] + 7 * dx, tip[1] + 7 * dy], [tip[0] - 5 * dy, tip[1] + 5 * dx], [tip[0] + 5 * dy, tip[1] - 5 * dx]], { width: 1, colour: theme.accent, fill: theme.accent, closed: true });
    }

    // Mark what is selected, what findings are about, and what is under the pointer.
    #highlights(pen, sketch) {
        const { theme } = this.page;
        const { selection } = this;
        if (selection && this.machine) this.#highlight(pen, sketch, selection, theme.accent);
        if (this.marked) {
            sketch.bodies.forEach((body) => this.marked.has(body) && body !== GROUND && this.#highlight(pen, sketch, { kind: "body", body }, theme.bad));
            sketch.data.points.forEach((_, k) => this.marked.has(sketch.nameOf(k)) && this.#highlight(pen, sketch, { kind: "point", at: sketch.point(k) }, theme.bad));
        }
    }

    #highlight(pen, sketch, target, colour) {
        const { view } = this.page;
        if (target.kind === "point") pen.circle(...view.pixel(target.at), 11, { width: 2.5, colour });
        const isOwn = (line) => (target.kind === "body" ? line.body === target.body : line.table === target.table && line.name === target.name);
        if (target.kind !== "point") for (const { ends } of sketch.lines.filter(isOwn)) pen.line(ends.map((p) => view.pixel(p)), { width: 3, colour, alpha: 0.9 });
    }

    #preview(pen, sketch) {
        const { machine, here, pressed } = this;
        const { view, theme } = this.page;
        const picks = pressed?.isMoved && !machine.picks.length && machine.tool !== "move" ? [pressed.target] : machine.picks;
        for (const { at } of picks) pen.circle(...view.pixel(at), 6, { width: 2, colour: theme.accent });
        const drag = this.#drag();
        if (drag) {
            pen.circle(...view.pixel(drag.to), 10, { width: 2.5, colour: theme.accent });
            this.#note(pen, view.pixel(drag.to), measured(drag.to, null));
            return;
        }
        if (!here || (machine.tool === "scale" && picks.length > 1)) return;
        const target = this.#target();
        const at = view.pixel(target.at);
        const base = picks[picks.length - 1];
        if (base) pen.line([view.pixel(base.at), at], { width: 2.5, colour: theme.accent, dash: machine.tool === "link" ? null : [7, 5], alpha: 0.8 });
        if (target.kind === "point") pen.circle(...at, 10, { width: 2.5, colour: theme.accent });
        else if (target.kind !== "free") this.#highlight(pen, sketch, target, theme.accent);
        if (machine.tool !== "move" || here.isKey) {
            const arm = here.isKey ? 14 : 7;
            for (const [dx, dy] of [[arm, 0], [0, arm]]) pen.line([[at[0] - dx, at[1] - dy], [at[0] + dx, at[1] + dy]], { width: 1.5, colour: theme.accent });
            if (!base || distance(base.at, target.at)) this.#note(pen, at, measured(target.at, base?.at));
        }
    }

    // Write next to a place, on the side that is in the view.
    #note(pen, [x, y], text) {
        const { view, theme } = this.page;
        const isLeft = x > view.width - 140;
        pen.text(x + (isLeft ? -15 : 15), y - 16, text, { colour: theme.ink, size: 12, halo: theme.paper, align: isLeft ? "right" : "left" });
    }

    // ---- the pointer

    #pointer() {
        const stage = $("stage");
        const { canvas, view } = this.page;
        const fingers = new Set();
        const place = (event) => {
            const box = canvas.getBoundingClientRect();
            return [event.clientX - box.left, event.clientY - box.top];
        };
        const note = (event) => {
            const isTouch = event.pointerType === "touch";
            this.here = { p: view.plane(place(event)), isKey: false, isFree: event.altKey, isAngled: event.shiftKey, reach: (isTouch ? 20 : 11) / view.scale };
            this.isTouch = isTouch;
            this.#placeField();
            this.page.refresh();
        };
        const on = (kind, act) => stage.addEventListener(kind, (event) => event.target === canvas && this.isShown && act(event), true);
        on("pointerdown", (event) => {
            fingers.add(event.pointerId);
            this.isPressed = false;
            this.pressed = null;
            if (fingers.size > 1 || event.button !== 0 || !this.machine) return;
            note(event);
            const target = this.#target();
            this.pressed = { at: place(event), here: this.here, target, isMoved: false };
            this.isPressed = this.machine.tool !== "move" || target.kind !== "free" || this.machine.picks.length > 0;
        });
        on("pointermove", (event) => {
            if (fingers.size > 1) return;
            note(event);
            if (this.pressed && distance(place(event), this.pressed.at) > CLICK) this.pressed.isMoved = true;
        });
        const end = (event) => {
            fingers.delete(event.pointerId);
            const { pressed, machine } = this;
            if (event.type === "pointerup" && pressed && machine && event.target === canvas) this.#released(pressed);
            this.pressed = null;
            setTimeout(() => (this.isPressed = false));
        };
        stage.addEventListener("pointerup", end, true);
        stage.addEventListener("pointercancel", end, true);
        on("pointerleave", () => {
            if (!this.isTouch) this.here = null;
            this.page.refresh();
        });
    }

    #released(pressed) {
        const { machine, here } = this;
        const drag = this.#drag();
        if (machine.tool === "move" && !machine.picks.length) {
            if (drag && pressed.isMoved) this.operate(drag.operations);
            else if (!pressed.isMoved) this.click(here);
            return;
        }
        const isLine = toolOf(machine.tool)?.accepts.length === 2;
        if (pressed.isMoved && isLine && !machine.picks.length) this.click(pressed.here);
        this.click(here);
    }

    // ---- keys and typed numbers

    #keys() {
        document.addEventListener("keydown", (event) => {
            if (!this.sketch) return;
            const key = event.key.toLowerCase();
            if ((event.ctrlKey || event.metaKey) && key === "s") {
                event.preventDefault();
                this.save();
                return;
            }
            const { target } = event;
            const isField = target.closest?.("input, select, textarea, dialog[open], pre");
            if (isField || event.ctrlKey || event.metaKey) return;
            const isButton = target.closest?.("button, summary");
            const act = this.isShown ? this.#actOf(event.key, key, event, isButton) : key === "v" && (() => this.choose("move")); // other letters are those of the page
            if (!act) return;
            event.preventDefault();
            event.stopImmediatePropagation();
            act();
        }, true);
    }

    #actOf(key, letter, event, isButton) {
        const { machine, page } = this;
        const far = event.shiftKey ? 10 : 1;
        const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
        const tool = TOOLS.find((one) => one.key === letter);
        if (tool) return () => this.choose(tool.id);
        if (key === "Home") return () => page.fit();
        if (!machine) return null;
        if (key in arrows) return () => this.#moveCursor(...arrows[key].map((x) => x * far));
        if (key === "Enter" && !isButton) return () => this.here && this.click(this.here);
        if (key === " " && !isButton) return this.isPlayable ? () => (this.leave(), page.motion.play()) : () => {};
        if (key === "Escape") return () => this.#escape();
        if (["Delete", "Backspace"].includes(key) && this.selection) return () => this.operate(deletions(this.selection));
        if (/^[-\d.@<]$/.test(key)) return () => this.#openField(key);
        return null;
    }

    #escape() {
        this.machine = this.machine.tool in OF_PICTURE ? chosen("move") : escaped(this.machine);
        this.chosenName = null;
        this.tell("");
        this.#changed();
    }

    // Move the cursor by steps of the grid; the view follows.
    #moveCursor(dx, dy) {
        const { view } = this.page;
        const { step } = this;
        const from = this.here?.p || this.base || [view.x, view.y];
        const p = [from[0] + dx * step, from[1] + dy * step].map((x) => clean(x, step));
        this.here = { p, isKey: true, isFree: false, isAngled: false, reach: 0.5 * step };
        const at = view.pixel(p);
        const beyond = [[at[0], view.width], [at[1], view.height]].map(([x, size]) => Math.min(x - 60, 0) + Math.max(x - size + 60, 0));
        if (beyond[0] || beyond[1]) view.pan(-beyond[0], -beyond[1]);
        this.#placeField();
        this.page.refresh();
    }

    #openField(text) {
        const { field } = this;
        field.hidden = false;
        field.value = text;
        field.focus();
        this.#placeField();
    }

    // Put the field for typed numbers next to the pointer; with a finger it is always in the bar.
    #placeField() {
        const { field, machine, here, isTouch } = this;
        const isWaiting = machine && (machine.tool !== "move" || this.selection);
        const isInBar = Boolean(isTouch && isWaiting);
        if (isInBar !== (field.parentElement === $("draw-bar"))) (isInBar ? $("draw-bar") : $("stage")).append(field);
        if (document.activeElement !== field && !field.value) field.hidden = !isInBar;
        const isOfLength = machine && (machine.tool === "scale" || (machine.tool === "move" && this.selection?.kind === "body"));
        field.placeholder = isOfLength ? "length" : machine && this.base ? "length < angle" : "x, y";
        if (isInBar || field.hidden) return;
        const { view } = this.page;
        const [x, y] = here ? view.pixel(here.p) : [0.5 * view.width, 0.5 * view.height];
        field.style.left = `${Math.min(Math.max(x + 16, 8), view.width - 150)}px`;
        field.style.top = `${Math.min(Math.max(y + 14, 50), view.height - 80)}px`;
    }

    #closeField() {
        const { field } = this;
        const isFocused = document.activeElement === field;
        field.value = "";
        field.classList.remove("wrong");
        if (isFocused && !this.isTouch) this.page.canvas.focus();
        this.#placeField();
    }

    #field() {
        const field = element("input", { type: "text", id: "typed", hidden: true, autocomplete: "off", "aria-label": "Length, length < angle, or x, y" });
        field.addEventListener("keydown", (event) => {
            if (event.key === "Escape") this.#closeField();
            if (event.key !== "Enter") return;
            event.preventDefault();
            const problem = field.value.trim() ? this.typed(field.value) : "";
            field.classList.toggle("wrong", Boolean(problem));
            if (problem) this.#bar(problem);
            else this.#closeField();
        });
        field.addEventListener("blur", () => !field.value && this.#placeField());
        return field;
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

    // ---- parts of the page

    #build() {
        const { page } = this;
        document.head.append(element("style", { textContent: EDITOR_STYLE }));
        const header = document.querySelector("header");
        const tools = element("div", { id: "draw-tools", role: "toolbar", "aria-label": "Drawing tools", hidden: true });
        for (const { id, key, label, hints } of TOOLS) {
            const button = element("button", { title: `${hints[0]} (${key.toUpperCase()})`, "aria-pressed": "false" });
            button.dataset.tool = id;
            button.innerHTML = `<svg viewBox="0 0 20 20">${ICONS[id]}</svg><span>${label}</span>`;
            button.addEventListener("click", () => {
                this.choose(id);
                page.canvas.focus({ preventScroll: true });
            });
            tools.append(button);
        }
        header.after(tools);
        const save = element("button", { id: "save", title: "Write the file (Ctrl+S)", textContent: "Save", hidden: true });
        save.addEventListener("click", () => this.save());
        $("reset").before(save);
        const button = element("button", { id: "draw", title: "Draw: change the mechanism itself", "aria-pressed": "false" });
        button.innerHTML = `${PEN}<span>Draw</span>`;
        button.addEventListener("click", () => (this.machine && this.isPlayable ? this.leave() : this.choose(this.sketch && !this.sketch.data.points.length ? "link" : "move")));
        $("edit").before(button, element("span", { id: "badge", role: "status", hidden: true }));
        this.field = this.#field();
        $("stage").append(element("div", { id: "draw-banner", role: "alert", hidden: true }), element("div", { id: "draw-bar", hidden: true }), this.field);
        const panel = element("div", { id: "draw-panel", hidden: true });
        document.querySelector("aside").append(panel);
        this.panel = new DrawPanel(this, panel);
        Object.assign($("keys-title"), { tabIndex: -1, autofocus: true }); // the dialog begins at its top
        for (const [head, text] of KEYS) {
            const row = element("tr");
            row.innerHTML = `<td>${head}</td><td>${text}</td>`;
            document.querySelector("#keys table").append(row);
        }
        for (const kind of ["click", "input"]) $("transport").addEventListener(kind, () => this.leave(), true);
    }
}

function lock(pen, [x, y], theme) {
    const style = { width: 1.5, colour: theme.ink };
    pen.circle(x, y, 11, { ...style, width: 1, fill: theme.paper });
    pen.line(Array.from({ length: 9 }, (_, k) => [x - 3 * Math.cos((Math.PI * k) / 8), y - 3 - 3 * Math.sin((Math.PI * k) / 8)]), style);
    pen.line([[x - 5, y - 2], [x + 5, y - 2], [x + 5, y + 5], [x - 5, y + 5]], { ...style, fill: theme.paper, closed: true });
}
