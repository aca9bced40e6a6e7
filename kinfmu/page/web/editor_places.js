// Places of a sketch: what is under the pointer, where a click counts as, and numbers that are typed.

import { distance, distanceToSegment } from "./geometry.js";
import { niceStep } from "./numbers.js";

const GRID = 9; // [px] between places to which clicks snap, at least
const ANGLE = Math.PI / 12; // to which links snap with Shift
export const ONE_PIN = 1e-6; // of the size; points that are closer are one pin
const DIGITS = 14; // of a place, compared with the length of its line
const DEGREE = Math.PI / 180;
export const GROUND = "ground";

// Return the distance of places to which clicks snap, for a view of so many pixels per unit.
export function gridOf(scale) {
    return niceStep(GRID / scale);
}

// Return a number without the digits that only rounding has put there.
export function clean(value, step) {
    const digits = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9) + 1);
    return Number((Math.round(value / step) * step).toFixed(Math.min(digits, 20))) + 0;
}

// ---- what is at a place
//
// A target is { kind, at, bodies, ... }: of a "point" also point (the name that operations take), points, joints, onGround (those
// of them with the ground) and open (pairs of points that no joint holds together); of a "body" also body and along (of its
// line); of a "member" (a cylinder, spring, rod, motor or force) also table and name; "free": nothing.

// Return the target at a place within a reach; members: whether cylinders, springs and rods count; symbols: other members, where
// no link is nearer.
export function hit(sketch, p, reach, hasMembers = false, symbols = []) {
    const pin = nearest(sketch.pins.map((one) => ({ ...one, gap: distance(one.at, p) })), reach);
    if (pin) return pointTarget(sketch, pin);
    const near = (all) => all.map((line) => ({ ...line, gap: distanceToSegment(p, ...line.ends) })).filter((line) => line.gap < 0.7 * reach);
    const lines = near(sketch.lines);
    const bars = lines.filter((line) => !line.table).sort((a, b) => a.gap - b.gap);
    const beyond = near(symbols).filter((line) => !(line.gap > bars[0]?.gap));
    const member = hasMembers && nearest([...lines.filter((line) => line.table), ...beyond], reach);
    if (member) return { kind: "member", at: p, bodies: [], table: member.table, name: member.name };
    if (bars.length) return bodyTarget(bars, p, reach);
    const area = sketch.areas.find((one) => one.contains(p));
    return area ? { kind: "body", at: p, body: area.body, bodies: [area.body] } : { kind: "free", at: p, bodies: [] };
}

function nearest(all, reach) {
    return all.filter((one) => one.gap < reach).sort((a, b) => a.gap - b.gap)[0] || null;
}

function pointTarget(sketch, { at, points }) {
    const { data } = sketch;
    const names = points.map((k) => sketch.nameOf(k));
    const own = points.map((k) => data.points[k].body);
    const through = sketch.lines.filter((line) => !line.table && distanceToSegment(at, ...line.ends) < ONE_PIN * sketch.size).map((line) => line.body);
    const joints = data.joints.filter((joint) => joint.points?.some((k) => points.includes(k)));
    const onGround = joints.filter((joint) => joint.points.some((k) => data.points[k].body === GROUND)).map(({ name }) => name);
    const held = points.map((k) => sketch.heldWith(k));
    const open = names.flatMap((a, i) => names.slice(i + 1).map((b, j) => [i, i + 1 + j])).filter(([i, j]) => held[i] !== held[j] && own[i] !== own[j]).map((pair) => pair.map((k) => names[k]));
    const first = Math.max(own.indexOf(GROUND), 0);
    const isEnd = own[first] !== GROUND && data.points.filter((one) => one.body === own[first]).length <= 2; // without it no link is left
    return { kind: "point", at: [...at], point: names[first], points: names, body: own[first], bodies: [...new Set([...own, ...through])], joints: joints.map(({ name }) => name), onGround, open, isEnd };
}

function bodyTarget(bars, p, reach) {
    const [{ body, ends: [a, b] }] = bars;
    const length = distance(a, b) || 1;
    const along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    const bodies = [...new Set(bars.map((line) => line.body))];
    const other = bars.find((line) => line.body !== body);
    const crossing = other && crossingOf([a, b], other.ends);
    if (crossing && distance(crossing, p) < reach) return { kind: "body", at: crossing, body, bodies, along, isExact: true };
    return { kind: "body", at: p, body, bodies, along, ends: [a, b] };
}

// Return where two straight lines cross, null if they are parallel.
export function crossingOf([a, b], [c, d]) {
    const [u, v, w] = [[b[0] - a[0], b[1] - a[1]], [d[0] - c[0], d[1] - c[1]], [c[0] - a[0], c[1] - a[1]]];
    const area = u[0] * v[1] - u[1] * v[0];
    if (Math.abs(area) < 1e-9 * Math.hypot(...u) * Math.hypot(...v)) return null;
    const part = (w[0] * v[1] - w[1] * v[0]) / area;
    return [a[0] + part * u[0], a[1] + part * u[1]];
}

// ---- where a click counts as

// Return the target of a click at p: a pin, a place on a body, or a place of the grid. base: from where a link is drawn;
// isFree: nothing snaps; isAngled: directions from the base snap.
export function snapped(sketch, p, { reach, step, base = null, isFree = false, isAngled = false, hasMembers = false, symbols = [] }) {
    const fine = step / 100;
    if (isFree) return { kind: "free", at: p.map((x) => clean(x, fine)), bodies: [] };
    const found = hit(sketch, p, reach, hasMembers, symbols);
    if (found.kind === "point" || found.kind === "member" || found.isExact) return found;
    if (found.ends) return { ...found, at: alongLine(found.ends, p, step) };
    if (found.kind === "free" && base && isAngled) {
        const angle = ANGLE * Math.round(Math.atan2(p[1] - base[1], p[0] - base[0]) / ANGLE);
        return { ...found, at: polar(base, clean(distance(p, base), step), angle) };
    }
    return { ...found, at: p.map((x) => clean(x, step)) };
}

// Return the place on a line that is nearest to p, of those on lines of the grid that cross it, and of its middle.
function alongLine([a, b], p, step) {
    const length = distance(a, b);
    if (!length) return a;
    const way = [b[0] - a[0], b[1] - a[1]];
    const wanted = Math.min(Math.max(((p[0] - a[0]) * way[0] + (p[1] - a[1]) * way[1]) / length ** 2, 0), 1);
    const axis = Math.abs(way[0]) >= Math.abs(way[1]) ? 0 : 1;
    const onGrid = (clean(a[axis] + wanted * way[axis], step) - a[axis]) / way[axis];
    const part = [onGrid, 0.5].filter((one) => one > 0 && one < 1).sort((x, y) => Math.abs(x - wanted) - Math.abs(y - wanted))[0] ?? wanted;
    return [0, 1].map((k) => rounded(a[k] + part * way[k], length));
}

function polar([x, y], length, angle) {
    return [rounded(x + length * Math.cos(angle), length), rounded(y + length * Math.sin(angle), length)];
}

// Return a number of a place without the digits that only rounding has put there; on a line of a length it stays on the line.
function rounded(value, length) {
    return Number(value.toFixed(Math.min(Math.max(DIGITS - Math.ceil(Math.log10(length)), 0), 20))) + 0;
}

// ---- typed numbers

const NUMBER = "([-+]?(?:\\d+\\.?\\d*|\\.\\d+)(?:e[-+]?\\d+)?)";
const FORMS = [
    [RegExp(`^(@?)\\s*${NUMBER}\\s*[,;]\\s*${NUMBER}$`, "i"), "place"],
    [RegExp(`^${NUMBER}\\s*[<\\s]\\s*${NUMBER}\\s*(?:deg|\u00b0)?$`, "i"), "polar"],
    [RegExp(`^<\\s*${NUMBER}\\s*(?:deg|\u00b0)?$`, "i"), "angle"],
    [RegExp(`^${NUMBER}$`, "i"), "length"],
];

// Return what a text means: { at } with a place, { value } for a single number without a base, or { problem }.
export function typed(text, base, towards) {
    const [form, numbers, sign] = read(text.trim());
    if (!form) return { problem: `"${text}" is neither a length, a length < angle, nor x, y` };
    const [first, second] = numbers;
    if (form === "place") return { at: sign && base ? [base[0] + first, base[1] + second] : [first, second] };
    if (!base) return form === "length" ? { value: first } : { problem: "type x, y: there is no place yet from which a length counts" };
    const [dx, dy] = [towards[0] - base[0], towards[1] - base[1]];
    const length = form === "angle" ? Math.hypot(dx, dy) : first;
    if (!(length > 0)) return { problem: "a length must be greater than 0" };
    const angle = form === "polar" ? second * DEGREE : form === "angle" ? first * DEGREE : Math.atan2(dy, dx);
    return { at: polar(base, length, angle), value: first };
}

function read(text) {
    for (const [pattern, form] of FORMS) {
        const match = text.match(pattern);
        if (match && form === "place") return [form, match.slice(2).map(Number), match[1]];
        if (match) return [form, match.slice(1).map(Number), ""];
    }
    return [];
}

// Return a place as what is typed for it: the length and angle from a base, or coordinates.
export function measured(at, base) {
    const short = (value) => String(Number(value.toPrecision(5)));
    if (!base) return `${short(at[0])}, ${short(at[1])}`;
    return `${short(distance(at, base))} < ${short(Math.atan2(at[1] - base[1], at[0] - base[0]) / DEGREE)}`;
}

// ---- locked lengths

// Return the place nearest to `to` where a pin may be moved: others: places that stay, at distances that stay.
export function kept(at, to, others) {
    const circles = others.map((centre) => ({ centre, radius: distance(at, centre) })).filter(({ radius }) => radius > 0);
    if (!circles.length) return to;
    if (circles.length > 1) return at;
    const [{ centre, radius }] = circles;
    const length = distance(to, centre);
    return length ? [0, 1].map((k) => centre[k] + (radius * (to[k] - centre[k])) / length) : at;
}
