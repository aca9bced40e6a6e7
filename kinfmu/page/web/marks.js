// Marks on the drawing: transmission angles, instant centres, limits and change points of drivers; arrows of motion and forces.

import { CAMS } from "./forms.js";
import { distance, TURN } from "./geometry.js";
import { centres, transmissions } from "./instants.js";
import { degrees, number } from "./numbers.js";
import { css } from "./pen.js";

export function marks(painter, show, { arrows, legend, isOnPins = true, gaps = [] }) {
    if (show.limits) driverMarks(painter, isOnPins);
    for (const ends of gaps) gapMark(painter, ends);
    if (show.transmission) transmissionMarks(painter);
    if (show.centres) centreMarks(painter);
    for (const one of arrows) arrow(painter, one);
    legend.forEach((one, k) => scale(painter, one, k));
}

// Draw the places of a pin that do not meet.
function gapMark({ pen, theme, dot }, ends) {
    const [a, b] = ends.map(dot);
    pen.line([a, b], { width: 3, colour: theme.bad, dash: [7, 5] });
    for (const p of [a, b]) pen.circle(...p, 7, { width: 2.5, colour: theme.bad });
}

// Draw a line of the legend: an arrow of a round force and its size.
function scale({ pen, theme, view }, { length, colour, text }, row) {
    const [x, y] = [34, view.height - 28 - 20 * row];
    pen.line([[x - 6, y], [x + length + 12 + 6.9 * text.length, y]], { width: 20, colour: theme.paper, cap: "butt" });
    head(pen, [x, y], [x + length, y], css(colour));
    pen.text(x + length + 10, y, text, { colour: css(colour), size: 12 });
}

function transmissionMarks(painter) {
    const { linkage, pen, theme } = painter;
    transmissions(linkage).forEach(({ angle, at, arms }, k) => {
        const p = painter.dot(at);
        const r = 30;
        const [a, b] = arms.map(([x, y]) => Math.atan2(y, x));
        const sweep = Math.atan2(Math.sin(b - a), Math.cos(b - a));
        const arc = Array.from({ length: 25 }, (_, i) => {
            const w = a + (sweep * i) / 24;
            return [p[0] + r * Math.cos(w), p[1] - r * Math.sin(w)];
        });
        const acute = Math.min(angle, Math.PI - angle);
        const colour = acute < (40 * Math.PI) / 180 ? theme.bad : theme.accent;
        pen.line(arc, { width: 2, colour });
        painter.names.coverAll(arc, 2);
        const w = a + sweep / 2;
        const label = `${degrees(angle, 1)}${acute < (40 * Math.PI) / 180 ? " poor" : ""}`;
        painter.name(label, [[p[0] + (r + 6) * Math.cos(w), p[1] - (r + 6) * Math.sin(w)]], colour, 14, -1, { key: `transmission ${k}` });
    });
}

function centreMarks(painter) {
    const { linkage, pen, theme, view } = painter;
    const shown = centres(linkage).map(({ at, label }) => ({ p: painter.dot(at), label }));
    const merged = [];
    for (const one of shown) {
        const same = merged.find((other) => distance(other.p, one.p) < 2);
        if (same) same.label += `, ${one.label}`;
        else merged.push(one);
    }
    for (const { p, label } of merged) {
        if (p[0] < -20 || p[1] < -20 || p[0] > view.width + 20 || p[1] > view.height + 20) continue;
        pen.line([[p[0] - 5, p[1] - 5], [p[0] + 5, p[1] + 5]], { width: 2, colour: theme.accent });
        pen.line([[p[0] - 5, p[1] + 5], [p[0] + 5, p[1] - 5]], { width: 2, colour: theme.accent });
        painter.name(`P${label}`, [p], theme.accent, 12, -1);
    }
}

// Draw a line from a to b that ends with the head of an arrow.
function head(pen, a, b, ink) {
    const length = distance(a, b);
    const [x, y] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    const size = Math.min(10, 0.6 * length);
    const base = [b[0] - size * x, b[1] - size * y];
    pen.line([a, base], { width: 2.4, colour: ink });
    pen.line([b, [base[0] - 0.4 * size * y, base[1] + 0.4 * size * x], [base[0] + 0.4 * size * y, base[1] - 0.4 * size * x]], { width: 1, colour: ink, fill: ink, closed: true });
}

// Draw an arrow; its text is next to its head.
function arrow(painter, { from, along, colour, text }) {
    const a = painter.dot(from);
    const b = [a[0] + along[0], a[1] - along[1]];
    const length = distance(a, b);
    if (length < 2) return;
    const ink = css(colour);
    head(painter.pen, a, b, ink);
    painter.names.cover(a, b, 6);
    if (text) painter.name(text, [b], ink, 10, -1);
}

// Return the circle on which a turning driver has its range: about its pivot, around all of its body, so that it does not look
// like the base circle of a cam; on(u, r): a place on it; null for other drivers.
export function dialOf(linkage, k) {
    const driver = linkage.data.drivers[k];
    if (driver.kind !== "angle" || driver.pivot === null || driver.pivot === undefined) return null;
    const body = linkage.body(driver.body);
    const [pivot, centre] = [linkage.local(driver.pivot), linkage.point(driver.pivot)];
    const points = linkage.data.points.map((_, i) => i).filter((i) => linkage.bodyOf[i] === body);
    const far = points.reduce((best, i) => (distance(linkage.local(i), pivot) > distance(linkage.local(best), pivot) ? i : best), driver.pivot);
    const [tx, ty] = linkage.local(far).map((value, i) => value - pivot[i]);
    const cams = linkage.shapes.filter((shape) => shape.frame === driver.body && CAMS.includes(shape.kind));
    const outer = cams.map(({ anchor, points: corners }) => {
        const { x, y } = linkage.data.points[anchor] || { x: pivot[0], y: pivot[1] };
        return Math.max(...corners.map((p) => distance(p, [x, y])));
    });
    const turn = linkage.bodyPose(body)[2] - linkage.u[k] + (tx || ty ? Math.atan2(ty, tx) : 0);
    const [low, high] = linkage.ranges[k];
    const on = (u, r) => [centre[0] + r * Math.cos(u + turn), centre[1] + r * Math.sin(u + turn)];
    return { body, far: tx || ty ? far : null, reach: Math.max(Math.hypot(tx, ty), ...outer), low, span: Math.min(high - low, TURN), on };
}

// Mark the range of a turning driver, its limits and change points on its circle, with a handle on the outer pin of its body;
// without one, or where lengths are changed, at its value on the circle.
function driverMarks(painter, isOnPins) {
    const { linkage, pen, theme, view } = painter;
    linkage.data.drivers.forEach((_, k) => {
        const dial = dialOf(linkage, k);
        if (!dial) return;
        const { body, far, low, span } = dial;
        const radius = Math.max(dial.reach * view.scale, 24) + 16;
        const on = (u, r) => painter.dot(dial.on(u, r / view.scale));
        pen.line(Array.from({ length: 73 }, (_, i) => on(low + (span * i) / 72, radius)), { width: 1.4, colour: theme.quiet, dash: [2, 4] });
        const mark = (u, colour, label) => {
            pen.line([on(u, radius - 7), on(u, radius + 7)], { width: 3, colour });
            painter.names.cover(on(u, radius - 7), on(u, radius + 7), 3);
            painter.name(label, [on(u, radius + 8)], colour, 14, -1);
        };
        for (const limit of linkage.limits) if (limit.driver === k) mark(limit.at, theme.bad, `limit ${degrees(limit.at, 1)}`);
        for (const point of linkage.changePoints) if (point.driver === k) mark(point.at, theme.accent, `change point ${degrees(point.at, 1)}`);
        const isOnPin = far !== null && isOnPins;
        const p = isOnPin ? painter.dot(linkage.point(far)) : on(linkage.u[k], radius);
        if (isOnPin) for (const style of [{ width: 6, colour: theme.paper }, { width: 3.4, colour: theme.accent }]) pen.circle(...p, 9, style);
        else pen.circle(...p, 7, { width: 2, colour: theme.paper, fill: theme.accent });
        painter.names.boxes.add([p[0] - 9, p[1] - 9, p[0] + 9, p[1] + 9]);
        painter.handles.push({ driver: k, body, at: p });
    });
}

const LONGEST = 0.22; // of the smaller side of the view
const SHORTEST = 0.3; // of the longest one, where arrows of points at the edge would leave the view
const EDGE = 8; // [px] between the head of an arrow and the edge of the view
const OUTLIERS = 2; // times the longest arrow: forces may grow without bound near singular poses
const COLOURS = {
    velocity: { light: [0, 120, 85], dark: [90, 200, 150] },
    acceleration: { light: [160, 50, 115], dark: [235, 150, 200] },
    force: { light: [180, 70, 0], dark: [255, 160, 90] },
    shaking: { light: [105, 65, 190], dark: [190, 160, 255] },
};

// Return arrows { from, along, colour, text } in pixels, and a legend { length, colour, text } of those to a fixed scale.
export function arrows({ linkage, show, view, drawn, theme }) {
    const longest = LONGEST * Math.min(view.width, view.height);
    const inTheme = (kind) => COLOURS[kind][theme.isDark ? "dark" : "light"];
    const { unit } = linkage.data;
    const found = [];
    const legend = [];
    const rates = [];
    if (show.velocity) rates.push(["velocity", "v", `${unit}/s`]);
    if (show.acceleration) rates.push(["acceleration", "a", `${unit}/s2`]);
    for (const [kind, which, of] of rates) {
        const vectors = movingPoints(linkage, drawn).map((k) => ({ at: linkage.point(k), v: linkage.motionOf(linkage.bodyOf[k], linkage.point(k))[which] }));
        const most = Math.max(...vectors.map(({ v }) => Math.hypot(...v)), 0);
        if (!(most > 0) || !Number.isFinite(most)) continue;
        const largest = vectors.find(({ v }) => Math.hypot(...v) === most);
        const whole = vectors.map(({ at, v }) => ({ from: at, along: v.map((x) => (x * longest) / most) }));
        const part = Math.max(Math.min(...whole.map((one) => partInView(view, one))), SHORTEST);
        whole.forEach(({ from, along }, k) => {
            const text = vectors[k] === largest ? `${number(most, 3)} ${of}` : "";
            found.push({ from, along: along.map((x) => x * part), colour: inTheme(kind), text });
        });
    }
    const wanted = [...(show.forces ? ["force"] : []), ...(show.shaking ? ["shaking"] : [])];
    for (const kind of linkage.part.reactions.length ? wanted : []) {
        const most = linkage.largestForce(kind, (pose) => forces(linkage, kind, pose).map(({ v }) => Math.hypot(...v)));
        if (!(most > 0)) continue;
        for (const { at, v } of forces(linkage, kind, linkage.pose)) {
            const scale = Math.min(longest / most, (OUTLIERS * longest) / Math.max(Math.hypot(...v), 1e-300));
            found.push({ from: at, along: v.map((x) => x * scale), colour: inTheme(kind), text: "" });
        }
        const newton = roundBelow(most);
        legend.push({ length: (newton * longest) / most, colour: inTheme(kind), text: `${number(newton, 3)} N ${kind === "force" ? "in joints" : "shaking force"}` });
    }
    return { found, legend };
}

// Return the part of an arrow that is in the view: 1 for all of it, or if it does not begin there.
function partInView(view, { from, along }) {
    const start = view.pixel(from);
    const size = [view.width, view.height];
    if (start.some((x, axis) => x < 0 || x > size[axis])) return 1;
    const moves = [along[0], -along[1]]; // pixels, y down
    const parts = moves.map((move, axis) => (move ? (move > 0 ? size[axis] - EDGE - start[axis] : start[axis] - EDGE) / Math.abs(move) : 1));
    return Math.min(1, ...parts);
}

function movingPoints(linkage, drawn) {
    const ofJoints = linkage.data.joints.flatMap((joint) => (joint.points || []).slice(-1));
    const places = [...new Set([...drawn.map((one) => one.point), ...ofJoints])];
    return places.filter((point) => linkage.triples[linkage.bodyOf[point]][0] >= 0);
}

// Return forces { at, v [N] } of a pose: in joints, of the first body on the second, or that on the ground at its origin.
function forces(linkage, kind, pose) {
    const reactions = pose.reactions();
    if (kind === "shaking") return [{ at: [0, 0], v: [reactions.get("shaking_force_x"), reactions.get("shaking_force_y")] }];
    const found = [];
    for (const { name, type, points, axis } of linkage.data.joints) {
        if (points?.length !== 2) continue;
        const [a, b] = points.map((point) => linkage.point(point, pose));
        const force = reactions.get(`${name}.force`);
        if (reactions.has(`${name}.force_x`)) found.push({ at: b, v: [reactions.get(`${name}.force_x`), reactions.get(`${name}.force_y`)] });
        else if (force === undefined) continue;
        else if (type === "distance") {
            const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
            found.push({ at: b, v: [(force * (b[0] - a[0])) / length, (force * (b[1] - a[1])) / length] });
        } else if (axis !== undefined) {
            const turn = (linkage.bound.get(`joints.${name}.axis`) ?? axis) + linkage.bodyPose(linkage.bodyOf[points[0]], pose)[2];
            found.push({ at: b, v: [-force * Math.sin(turn), force * Math.cos(turn)] });
        }
    }
    return found.filter(({ v }) => v.every(Number.isFinite));
}

// Return the largest of 1, 2, 5, 10, ... that is at most a value.
function roundBelow(value) {
    const tens = 10 ** Math.floor(Math.log10(value));
    return [5, 2, 1].find((digit) => digit * tens <= value) * tens || tens;
}
