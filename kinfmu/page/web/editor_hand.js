// What the hand does in the editor: with a mouse, a pen or fingers, on the keyboard, and in the field for typed numbers.

import { $, element } from "./elements.js";
import { distance } from "./geometry.js";
import { clean, kept, snapped } from "./editor_places.js";
import { toolOf, TOOLS } from "./editor_tools.js";
import { OF_PICTURE } from "./editor_picture.js";

const CLICK = 7; // [px] that the pointer may move in a click

export class EditorHand {
    constructor(editor) {
        this.editor = editor;
        this.page = editor.page;
        this.here = null; // { p, isKey, isFree, isAngled, reach } the pointer, or the cursor that keys move
        this.pressed = null; // { at, here, target, isMoved } where the pointer went down
        this.isPressed = false; // on something that the tool takes
        this.isTouch = false;
        this.field = this.#field();
        $("stage").append(this.field);
        this.#pointer();
        this.#keys();
    }

    // Return the target of a click at what the pointer or cursor is.
    target(here = this.here) {
        const { editor } = this;
        const { machine } = editor;
        const tool = toolOf(machine.tool);
        const options = { symbols: editor.painter.symbols, reach: here.reach, step: editor.step, base: editor.base, isFree: here.isFree || machine.tool in OF_PICTURE, isAngled: here.isAngled, hasMembers: tool?.hasMembers || (machine.tool === "move" && !machine.picks.length) };
        return snapped(editor.sketch, here.p, options);
    }

    // Return the pin that is moved, where to, and the operations; on another pin it is pinned to that.
    get drag() {
        const { editor, pressed, here } = this;
        const { machine, sketch } = editor;
        if (machine?.tool !== "move" || !here) return null;
        const pin = machine.picks[0] || (pressed?.isMoved && pressed.target.kind === "point" && pressed.target);
        if (!pin) return null;
        const number = sketch.numberOfPoint(pin.point);
        if (number < 0) return null;
        const own = new Set(sketch.movingWith(number));
        const over = snapped({ ...sketch, pins: sketch.pins.filter((one) => !one.points.some((k) => own.has(k))), lines: [], areas: [], nameOf: (k) => sketch.nameOf(k), heldWith: (k) => sketch.heldWith(k) }, here.p, { reach: here.reach, step: editor.step, isFree: here.isFree });
        const to = kept(sketch.point(number), over.at, sketch.placesKept(number, editor.locked));
        const target = distance(to, over.at) ? { kind: "free", at: to } : over;
        return { number, to, operations: toolOf("move").make([pin, target]) };
    }

    #pointer() {
        const stage = $("stage");
        const { editor, page } = this;
        const { canvas, view } = page;
        const fingers = new Set();
        const place = (event) => {
            const box = canvas.getBoundingClientRect();
            return [event.clientX - box.left, event.clientY - box.top];
        };
        const note = (event) => {
            const isTouch = event.pointerType === "touch";
            this.here = { p: view.plane(place(event)), isKey: false, isFree: event.altKey, isAngled: event.shiftKey, reach: (isTouch ? 20 : 11) / view.scale };
            this.isTouch = isTouch;
            this.placeField();
            this.page.refresh();
        };
        const on = (kind, act) => stage.addEventListener(kind, (event) => event.target === canvas && editor.isShown && act(event), true);
        on("pointerdown", (event) => {
            fingers.add(event.pointerId);
            this.isPressed = false;
            this.pressed = null;
            if (fingers.size > 1 || event.button !== 0 || !editor.machine) return;
            note(event);
            const target = this.target();
            this.pressed = { at: place(event), here: this.here, target, isMoved: false };
            this.isPressed = editor.machine.tool !== "move" || target.kind !== "free" || editor.machine.picks.length > 0;
        });
        on("pointermove", (event) => {
            if (fingers.size > 1) return;
            note(event);
            if (this.pressed && distance(place(event), this.pressed.at) > CLICK) this.pressed.isMoved = true;
        });
        const end = (event) => {
            fingers.delete(event.pointerId);
            const { pressed } = this;
            if (event.type === "pointerup" && pressed && editor.machine && event.target === canvas) this.#released(pressed);
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
        const { editor, here, drag } = this;
        const { machine } = editor;
        if (machine.tool === "move" && !machine.picks.length) {
            if (drag && pressed.isMoved) editor.operate(drag.operations);
            else if (!pressed.isMoved) editor.click(here);
            return;
        }
        const isLine = toolOf(machine.tool)?.accepts.length === 2;
        if (pressed.isMoved && isLine && !machine.picks.length) editor.click(pressed.here);
        editor.click(here);
    }

    #keys() {
        const { editor } = this;
        document.addEventListener("keydown", (event) => {
            if (!editor.sketch) return;
            const key = event.key.toLowerCase();
            if ((event.ctrlKey || event.metaKey) && key === "s") {
                event.preventDefault();
                editor.save();
                return;
            }
            const { target } = event;
            const isField = target.closest?.("input, select, textarea, dialog[open], pre");
            if (isField || event.ctrlKey || event.metaKey) return;
            const isButton = target.closest?.("button, summary");
            const act = editor.isShown ? this.#actOf(event.key, key, event, isButton) : key === "v" && (() => editor.choose("move")); // other letters are those of the page
            if (!act) return;
            event.preventDefault();
            event.stopImmediatePropagation();
            act();
        }, true);
    }

    #actOf(key, letter, event, isButton) {
        const { editor, page } = this;
        const { machine } = editor;
        const far = event.shiftKey ? 10 : 1;
        const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
        const tool = TOOLS.find((one) => one.key === letter);
        if (tool) return () => editor.choose(tool.id);
        if (key === "Home") return () => page.fit();
        if (key === "?") return () => $("keys").showModal();
        if (["+", "="].includes(key)) return () => page.zoom(1.2);
        if (key === "e") return () => {}; // lengths are changed by the tool for moving
        if (!machine) return null;
        if (key in arrows) return () => this.#moveCursor(...arrows[key].map((x) => x * far));
        if (key === "Enter" && !isButton) return () => this.here && editor.click(this.here);
        if (key === " " && !isButton) return editor.isPlayable ? () => (editor.leave(), page.motion.play()) : () => {};
        if (key === "Escape") return () => editor.escape();
        if (["Delete", "Backspace"].includes(key) && editor.selection) return () => editor.deleteSelected();
        if (/^[-\d.@<]$/.test(key)) return () => this.#openField(key);
        return null;
    }

    // Move the cursor by steps of the grid; the view follows.
    #moveCursor(dx, dy) {
        const { view } = this.page;
        const { base, step } = this.editor;
        const from = this.here?.p || base || [view.x, view.y];
        const p = [from[0] + dx * step, from[1] + dy * step].map((x) => clean(x, step));
        this.here = { p, isKey: true, isFree: false, isAngled: false, reach: 0.5 * step };
        const at = view.pixel(p);
        const beyond = [[at[0], view.width], [at[1], view.height]].map(([x, size]) => Math.min(x - 60, 0) + Math.max(x - size + 60, 0));
        if (beyond[0] || beyond[1]) view.pan(-beyond[0], -beyond[1]);
        this.placeField();
        this.page.refresh();
    }

    #openField(text) {
        const { field } = this;
        field.hidden = false;
        field.value = text;
        field.focus();
        this.placeField();
    }

    // Put the field for typed numbers next to the pointer; with a finger it is always in the bar.
    placeField() {
        const { editor, field, here, isTouch } = this;
        const { machine, selection } = editor;
        const isWaiting = machine && (machine.tool !== "move" || (selection && selection.kind !== "member"));
        const isInBar = Boolean(isTouch && isWaiting);
        if (isInBar !== (field.parentElement === $("draw-bar"))) (isInBar ? $("draw-bar") : $("stage")).append(field);
        if (document.activeElement !== field && !field.value) field.hidden = !isInBar;
        const isOfLength = machine && (machine.tool === "scale" || (machine.tool === "move" && selection?.kind === "body"));
        field.placeholder = isOfLength ? "length" : machine && editor.base ? "length < angle" : "x, y";
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
        this.placeField();
    }

    #field() {
        const field = element("input", { type: "text", id: "typed", hidden: true, autocomplete: "off", "aria-label": "Length, length < angle, or x, y" });
        field.addEventListener("keydown", (event) => {
            if (event.key === "Escape") this.#closeField();
            if (event.key !== "Enter") return;
            event.preventDefault();
            const problem = field.value.trim() ? this.editor.typed(field.value) : "";
            field.classList.toggle("wrong", Boolean(problem));
            if (problem) this.editor.bar(problem);
            else this.#closeField();
        });
        field.addEventListener("blur", () => !field.value && this.placeField());
        return field;
    }
}
