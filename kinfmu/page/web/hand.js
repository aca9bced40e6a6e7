// What the hand does: on the drawing, with a mouse, a pen or fingers, and on the keyboard.

import { $ } from "./elements.js";
import { distance } from "./geometry.js";
import { gripAt, handleAt, parametersOf, pinAt, place, pull, stretch } from "./grips.js";
import { number } from "./numbers.js";

const SAME_PIN = 1e-6; // of the size; points that are closer are one pin

export class Hand {
    constructor(page) {
        this.page = page;
        this.held = null; // the place that is held, for the drawing
        this.pin = null; // number of the point that the keys move
        this.pointer = null; // { at, reach } of the mouse or the last touch [px], for names without a place
        const { canvas, view } = page;
        const held = new Map(); // pointers on the canvas
        let drag = null;
        const at = (event) => {
            const box = canvas.getBoundingClientRect();
            return [event.clientX - box.left, event.clientY - box.top];
        };
        const pixels = (event) => (event.pointerType === "touch" ? 26 : 13);
        const reach = (event) => pixels(event) / view.scale;
        const point = (event) => {
            this.pointer = { at: at(event), reach: pixels(event) };
            if (page.hasHidden) page.refresh();
        };
        canvas.addEventListener("pointerdown", (event) => {
            canvas.setPointerCapture(event.pointerId);
            held.set(event.pointerId, at(event));
            point(event);
            page.hint("");
            if (held.size === 2) {
                drag = { kind: "pinch" };
                [this.held, this.pointer] = [null, null];
                return;
            }
            drag = this.#grab(view.plane(at(event)), reach(event)) || { kind: "pan" };
            if (["pin", "grip"].includes(drag.kind)) page.motion.play(false);
            canvas.classList.add("dragging");
            page.refresh();
        });
        canvas.addEventListener("pointermove", (event) => {
            const p = at(event);
            const before = held.get(event.pointerId);
            if (drag?.kind !== "pinch") point(event);
            if (!before) {
                canvas.classList.toggle("grip", Boolean(this.#grab(view.plane(p), reach(event))));
                return;
            }
            if (drag?.kind === "pinch" && held.size === 2) {
                const [other] = [...held].filter(([id]) => id !== event.pointerId).map(([, place_]) => place_);
                const [was, is] = [before, p].map((one) => Math.hypot(one[0] - other[0], one[1] - other[1]));
                if (was > 0 && is > 0) view.zoom(is / was, [(p[0] + other[0]) / 2, (p[1] + other[1]) / 2]);
                view.pan((p[0] - before[0]) / 2, (p[1] - before[1]) / 2);
                page.refresh();
            } else if (drag?.kind === "pan") {
                view.pan(p[0] - before[0], p[1] - before[1]);
                page.refresh();
            } else if (["pin", "grip"].includes(drag?.kind)) {
                const dragged = drag;
                page.refresh(() => this.#drag(dragged, view.plane(p)), "hand");
            }
            held.set(event.pointerId, p);
        });
        const release = (event) => {
            held.delete(event.pointerId);
            if (drag?.kind === "pin") page.commit();
            if (drag?.kind === "grip") page.refresh(() => page.address.write());
            drag = null;
            canvas.classList.remove("dragging");
            page.refresh(() => (this.held = null)); // after the last place
        };
        canvas.addEventListener("pointerup", release);
        canvas.addEventListener("pointercancel", release);
        canvas.addEventListener("pointerleave", (event) => {
            if (event.pointerType === "touch" || held.size) return;
            this.pointer = null;
            if (page.hasHidden) page.refresh();
        });
        canvas.addEventListener("wheel", (event) => {
            event.preventDefault();
            page.zoom(Math.exp(-0.0016 * event.deltaY * (event.deltaMode ? 20 : 1)), at(event));
        }, { passive: false });
        canvas.addEventListener("dblclick", (event) => this.#toggleCurve(view.plane(at(event)), reach(event)));
    }

    // Return the place that is held, or the pin that the keys move; null without one.
    get place() {
        return this.held || (this.pin === null ? null : this.page.linkage.point(this.pin));
    }

    // Choose the next pin, or the one before (-1), among those that values which are not locked move.
    choosePin(way) {
        const { page } = this;
        const { linkage, design } = page;
        const isNew = (k, i, all) => all.findIndex((other) => distance(linkage.point(other), linkage.point(k)) < SAME_PIN * linkage.data.size) === i;
        const pins = linkage.data.points.map((_, k) => k).filter(isNew).filter((k) => parametersOf(linkage, design, k).length);
        if (page.mode !== "lengths") page.toggleMode();
        if (!pins.length) {
            page.hint("No value that is not locked moves a pin.");
            return;
        }
        const now = pins.indexOf(this.pin);
        this.pin = pins[(now < 0 ? (way > 0 ? 0 : pins.length - 1) : now + way + pins.length) % pins.length];
        this.#tellPin(" Arrow keys move it, P chooses the next one.");
        page.refresh();
    }

    // Move the chosen pin by steps; it is one step to undo.
    movePin(x, y) {
        const { page } = this;
        const { linkage } = page;
        page.motion.play(false);
        page.refresh(() => {
            const step = 10 ** Math.floor(Math.log10(linkage.data.size) - 2);
            const [px, py] = linkage.point(this.pin);
            this.#drag({ kind: "pin", point: this.pin, names: null }, [px + x * step, py + y * step]);
            this.held = null;
            if (page.design.isOk) this.#tellPin("");
        });
        page.commit();
    }

    leavePin() {
        this.pin = null;
        this.page.hint("");
        this.page.refresh();
    }

    #tellPin(more) {
        const { linkage } = this.page;
        const { body, name } = linkage.data.points[this.pin];
        this.page.hint(`${body}.${name} at ${linkage.point(this.pin).map((x) => number(x)).join(", ")} ${linkage.data.unit}.${more}`);
    }

    #grab(p, reach) {
        const { editor, linkage, mode, handles, view } = this.page;
        if (editor?.isShown) return editor.isPressed ? { kind: "drawn" } : null; // by the editor itself
        const handle = handleAt(linkage, view, handles, p, reach);
        const point = mode === "lengths" ? pinAt(linkage, p, handle ? handle.gap : reach) : null; // the nearer one
        if (point !== null) return { kind: "pin", point, names: null };
        const grip = handle || (mode === "move" ? gripAt(linkage, p, reach) : null);
        return grip && { kind: "grip", grip };
    }

    #drag(drag, target) {
        const { page } = this;
        const { linkage, design, motion } = page;
        if (drag.kind === "grip") {
            motion.arrive(pull(linkage, drag.grip, target));
            this.held = place(linkage, drag.grip);
            return;
        }
        drag.names ||= parametersOf(linkage, design, drag.point);
        if (!drag.names.length) {
            page.hint("No value that is not locked moves this pin.");
            return;
        }
        const isReached = stretch(linkage, design, drag.point, drag.names, target);
        motion.blocked = isReached ? "" : linkage.failure;
        this.held = linkage.point(drag.point);
        page.reshape();
    }

    #toggleCurve(p, reach) {
        const { editor, linkage, drawn, traces } = this.page;
        if (editor?.isShown) return;
        const point = pinAt(linkage, p, reach);
        if (point === null) return;
        const found = drawn.findIndex((one) => one.point === point);
        if (found >= 0) drawn.splice(found, 1);
        else drawn.push({ point, colour: linkage.data.bodies[linkage.bodyOf[point]].colour });
        traces.delete(point);
        this.page.reshape();
    }
}

export function keyboard(page) {
    const isField = (target) => target.closest?.("input, select, textarea, dialog[open], [role=tab]") || target.tagName === "CANVAS" && target !== page.canvas;
    document.addEventListener("click", (event) => {
        if (event.detail) event.target.closest("button")?.blur(); // a click by hand; the keys then are those of the page
    }, true); // before a dialog opens, which gives the focus back
    document.addEventListener("keydown", (event) => {
        const key = event.key.toLowerCase();
        if ((event.ctrlKey || event.metaKey) && (key === "z" || key === "y")) {
            event.preventDefault();
            page.undo(key === "y" || event.shiftKey);
            return;
        }
        const isSlider = event.target.type === "range";
        if ((isField(event.target) && !(isSlider && key === " ")) || event.ctrlKey || event.metaKey || event.altKey) return;
        const { linkage } = page;
        if (!linkage) return;
        const k = page.driver;
        const step = linkage.data.drivers[k]?.kind === "angle" ? Math.PI / 180 : (linkage.ranges[k][1] - linkage.ranges[k][0]) / 200;
        const by = (way) => {
            page.motion.play(false);
            page.refresh(() => page.move(k, linkage.u[k] + way * step * (event.shiftKey ? 10 : 1))); // every press counts
            page.address.writeSoon();
        };
        const choose = (way) => {
            const { drivers } = linkage.data;
            page.driver = (page.driver + way + drivers.length) % drivers.length;
            if (drivers.length > 1) page.hint(`Arrow keys move ${drivers[page.driver].name}`);
        };
        const pan = (x, y) => {
            page.view.pan(x, y);
            page.refresh();
        };
        const { hand } = page;
        const far = event.shiftKey ? 10 : 1;
        const arrow = (x, y) => (hand.pin !== null ? hand.movePin(x * far, y * far) : x ? by(x) : choose(-y));
        const acts = {
            arrowleft: () => arrow(-1, 0), arrowright: () => arrow(1, 0), arrowup: () => arrow(0, 1), arrowdown: () => arrow(0, -1),
            p: () => hand.choosePin(event.shiftKey ? -1 : 1), escape: () => hand.leavePin(),
            home: () => (linkage.data.over ? page.pick("driver", linkage.data.over.from) : page.pick("time", linkage.data.run.from)), "+": () => page.zoom(1.2), "=": () => page.zoom(1.2), "-": () => page.zoom(1 / 1.2),
            f: () => page.fit(), e: () => page.toggleMode(), "?": () => $("keys").showModal(),
            w: () => pan(0, 40), s: () => pan(0, -40), a: () => pan(40, 0), d: () => pan(-40, 0),
        };
        if (event.target === page.canvas || event.target === document.body || isSlider) acts[" "] = () => page.motion.play();
        const act = acts[key] && ((key.startsWith("arrow") || key === "home") && event.target !== page.canvas && event.target !== document.body ? null : acts[key]);
        if (!act) return;
        event.preventDefault();
        act();
    });
}
