// The drawing of the editor: the mechanism at its start pose, lighter while it is half-drawn, and what the tool does.

import { draw } from "./drawing.js";
import { $ } from "./elements.js";
import { distance, placed } from "./geometry.js";
import { CanvasPen, GREY, tint } from "./pen.js";
import { Spots } from "./names.js";
import { GROUND, measured, ONE_PIN } from "./editor_places.js";
import { Sketch } from "./editor_sketch.js";

const MOTOR = 19; // [px] radius of the arc of a motor
const PALE = 0.62; // of what is half-drawn

export class EditorPainter {
    constructor(editor) {
        this.editor = editor;
        this.page = editor.page;
        this.spots = new Spots();
        this.symbols = []; // of loads and motors: their lines { table, name, ends } in the plane
        this.layer = new OffscreenCanvas(1, 1); // of what is drawn lighter
    }

    paint(context) {
        const { editor, page } = this;
        const { sketch } = editor;
        const { view, theme } = page;
        const pen = new CanvasPen(context);
        editor.picture.paint(context, view);
        const show = { names: true, loads: true };
        const extra = { curves: [], arrows: [], legend: [], held: null, isGhost: false };
        const nothing = new Sketch({ ...sketch.data, bodies: sketch.data.bodies.slice(0, 1), points: [], joints: [], drivers: [], shapes: [], loads: [], interest: [], cams: [], gravity: null });
        draw(pen, nothing, view, theme, { grid: true }, extra, this.spots);
        this.spots.begin(page.now, sketch.pose, view);
        const { drag } = editor.hand;
        const shown = drag ? sketch.moved(drag.number, drag.to) : sketch;
        const layer = editor.session.answer.badge.isComplete ? null : this.layer;
        const target = layer ? layer.getContext("2d") : context;
        if (layer) {
            [layer.width, layer.height] = [context.canvas.width, context.canvas.height]; // and without what was drawn before
            target.setTransform(context.getTransform());
        }
        const motors = this.#motors(shown);
        extra.covered = motors.map(({ at }) => [at, MOTOR]);
        const { symbols } = draw(new CanvasPen(target), shown, view, theme, show, extra, this.spots);
        this.#marks(new CanvasPen(target), shown);
        symbols.push(...motors.flatMap((motor) => this.#motor(new CanvasPen(target), motor)));
        this.symbols = symbols.map((one) => ({ ...one, ends: one.ends.map((p) => view.plane(p)) }));
        if (layer) {
            context.save();
            context.resetTransform();
            context.globalAlpha = PALE;
            context.drawImage(layer, 0, 0);
            context.restore();
        }
        this.#highlights(pen, shown);
        if (editor.machine) this.#preview(pen, shown);
        [page.handles, page.hasHidden] = [[], false];
        if (editor.isPlayable) page.transport.update();
        [$("undo").disabled, $("redo").disabled] = [!editor.canUndo(false), !editor.canUndo(true)];
    }

    // Draw points that no joint holds, places on the ground without a joint, and locks.
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
                const colour = tint("edge", GREY, theme);
                pen.line([[x, y], [x - 10, y + 17], [x + 10, y + 17]], { width: 1.3, colour, fill: tint("fill", GREY, theme), closed: true });
                pen.line([[x - 15, y + 17], [x + 15, y + 17]], { width: 1.6, colour });
            }
            pen.circle(x, y, size, { width: 1.6, colour: theme.ink, fill: theme.paper });
        }
        for (const body of this.editor.locked) {
            const line = sketch.lines.find((one) => one.body === body);
            if (line) lock(pen, view.pixel([0, 1].map((k) => 0.7 * line.ends[0][k] + 0.3 * line.ends[1][k])), theme);
        }
    }

    // Return the drivers of angles, each with the pixel at its pivot.
    #motors(sketch) {
        const { data } = sketch;
        const found = data.drivers.filter(({ kind }) => kind === "angle").map(({ name, pivot, body }) => ({ name, number: pivot ?? data.points.findIndex((one) => one.body === body) }));
        return found.filter(({ number }) => number >= 0).map(({ name, number }) => ({ name, at: this.page.view.pixel(sketch.point(number)) }));
    }

    // Draw the arc of a motor, and return its lines.
    #motor(pen, { name, at: [x, y] }) {
        const { theme } = this.page;
        const arc = Array.from({ length: 25 }, (_, k) => -0.5 + (4.4 * k) / 24).map((angle) => [x + MOTOR * Math.cos(angle), y - MOTOR * Math.sin(angle)]);
        pen.line(arc, { width: 2.2, colour: theme.accent });
        const [tip, before] = [arc[24], arc[21]];
        const [dx, dy] = [(tip[0] - before[0]) / distance(tip, before), (tip[1] - before[1]) / distance(tip, before)];
        pen.line([[tip[0] + 7 * dx, tip[1] + 7 * dy], [tip[0] - 5 * dy, tip[1] + 5 * dx], [tip[0] + 5 * dy, tip[1] - 5 * dx]], { width: 1, colour: theme.accent, fill: theme.accent, closed: true });
        return arc.slice(1).map((b, k) => ({ table: "drivers", name, ends: [arc[k], b] }));
    }

    // Mark what is selected, what findings are about, and what is under the pointer.
    #highlights(pen, sketch) {
        const { theme } = this.page;
        const { selection, marked, machine } = this.editor;
        if (selection && machine) this.#highlight(pen, sketch, selection, theme.accent);
        if (marked) {
            sketch.bodies.forEach((body) => marked.has(body) && body !== GROUND && this.#highlight(pen, sketch, { kind: "body", body }, theme.bad));
            sketch.data.points.forEach((_, k) => marked.has(sketch.nameOf(k)) && this.#highlight(pen, sketch, { kind: "point", at: sketch.point(k) }, theme.bad));
        }
    }

    #highlight(pen, sketch, target, colour) {
        const { view } = this.page;
        if (target.kind === "point") pen.circle(...view.pixel(target.at), 11, { width: 2.5, colour });
        const isOwn = (line) => (target.kind === "body" ? line.body === target.body : line.table === target.table && line.name === target.name);
        if (target.kind !== "point") for (const { ends } of [...sketch.lines, ...this.symbols].filter(isOwn)) pen.line(ends.map((p) => view.pixel(p)), { width: 3, colour, alpha: 0.9 });
    }

    #preview(pen, sketch) {
        const { machine, hand } = this.editor;
        const { here, pressed, drag } = hand;
        const { view, theme } = this.page;
        const picks = pressed?.isMoved && !machine.picks.length && machine.tool !== "move" ? [pressed.target] : machine.picks;
        for (const { at } of picks) pen.circle(...view.pixel(at), 6, { width: 2, colour: theme.accent });
        if (drag) {
            pen.circle(...view.pixel(drag.to), 10, { width: 2.5, colour: theme.accent });
            this.#note(pen, view.pixel(drag.to), measured(drag.to, null));
            return;
        }
        if (!here || (machine.tool === "scale" && picks.length > 1)) return;
        const target = hand.target();
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
}

function lock(pen, [x, y], theme) {
    const style = { width: 1.5, colour: theme.ink };
    pen.circle(x, y, 11, { ...style, width: 1, fill: theme.paper });
    pen.line(Array.from({ length: 9 }, (_, k) => [x - 3 * Math.cos((Math.PI * k) / 8), y - 3 - 3 * Math.sin((Math.PI * k) / 8)]), style);
    pen.line([[x - 5, y - 2], [x + 5, y - 2], [x + 5, y + 5], [x - 5, y + 5]], { ...style, fill: theme.paper, closed: true });
}
