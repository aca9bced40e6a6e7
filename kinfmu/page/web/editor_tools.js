// The tools of the editor as a machine without a page: clicks on targets become operations.

import { distance } from "./geometry.js";
import { GROUND } from "./editor_places.js";

const moving = (target) => target.bodies.filter((body) => body !== GROUND);
const anywhere = () => "";
const onLink = (target) => (moving(target).length ? "" : "Click a link or its pin.");
const elsewhere = (target, picks) => (distance(target.at, picks[picks.length - 1].at) > 0 ? "" : "Click another place.");
const onOther = (target, picks) => (moving(target).some((body) => body !== moving(picks[0])[0]) ? "" : "Click another link.");

// Return a target as operations name a place.
export function placeOf({ kind, point, body, at }) {
    if (kind === "point") return { point };
    return kind === "body" ? { body, at } : { at };
}

// Return a place of the first moving body of a target.
function ownPlace(target) {
    const [body] = moving(target);
    const point = target.points?.find((name) => name.split(".")[0] === body);
    return point ? { point } : { body, at: target.at };
}

const two = (kind) => ([from, to]) => [{ do: kind, from: placeOf(from), to: placeOf(to) }];
const vector = (from, to) => [to.at[0] - from.at[0], to.at[1] - from.at[1]];

// Of each tool: accepts: for each click a function that returns why a target is refused; make: the operations of all clicks.
export const TOOLS = [
    { id: "move", key: "v", label: "Move", hints: ["Drag a pin. Click a link or pin to select it.", "Choose the new place."], accepts: [(target) => (target.kind === "point" ? "" : "Choose a pin."), anywhere],
        make: ([from, to]) => [{ do: "move", point: from.point, to: to.at }, ...(to.kind === "point" && !from.points.includes(to.point) ? [{ do: "pin", points: [from.point, to.point] }] : [])] },
    { id: "link", key: "l", label: "Link", hints: ["Click one end of the link.", "Click its other end, or type length, length < angle, or x, y. Esc, or a second click there, stops."], accepts: [anywhere, anywhere], isChain: true, make: two("bar") },
    { id: "pin", key: "p", label: "Pin", hints: ["Click where two links meet, or the pin of one link.", "Click the pin of the other link."], accepts: [onLink, (target, picks) => (target.kind === "point" && picks[0].kind === "point" ? onOther(target, picks) : "Click the pins of two links, or where they cross.")], make: pinned, isEarly: (target) => target.bodies.length > 1 && (target.kind === "body" || target.open.length > 0 || target.bodies.length > target.points.length) },
    { id: "ground", key: "g", label: "Ground", hints: ["Click a pin or a place to fix it to the ground."], accepts: [anywhere], make: ([at]) => [{ do: "ground", at: placeOf(at) }] },
    { id: "motor", key: "m", label: "Motor", hints: ["Click the link that turns."], accepts: [onLink], make: ([target]) => [{ do: "motor", body: moving(target)[0], ...(target.joints?.length === 1 ? { joint: target.joints[0] } : {}) }] },
    { id: "slider", key: "s", label: "Slider", hints: ["Click the pin that slides.", "Click where to, or a link along which it slides."], accepts: [onLink, elsewhere], make: sliding, options: [["pin", "Pin slides"], ["block", "Block slides, does not turn"]] },
    { id: "slot", key: "o", label: "Slot", hints: ["Click the pin in the slot.", "Click where the slot begins: on a link, or on free ground.", "Click where the slot ends."], accepts: [onLink, anywhere, elsewhere], make: slotted },
    { id: "cylinder", key: "c", label: "Cylinder", hints: ["Click one end of the cylinder.", "Click its other end."], accepts: [anywhere, elsewhere], make: two("cylinder") },
    { id: "gear", key: "r", label: "Gears", hints: ["Click a link that turns with a gear. A typed number is the ratio.", "Click the link with the other gear."], accepts: [onLink, onOther], number: "ratio",
        make: (targets, { number }) => [{ do: "gear", bodies: bodiesOf(targets), ...(number ? { ratio: number } : {}) }] },
    { id: "cam", key: "k", label: "Cam", hints: ["Click the link that is the cam.", "Click the pin or link that follows it."], accepts: [onLink, onOther], options: [["roller", "Roller"], ["flat_face", "Flat face"]],
        make: (targets, { option }) => [{ do: "cam", body: bodiesOf(targets)[0], follower: ownPlace({ ...targets[1], bodies: [bodiesOf(targets)[1]] }), kind: option }] },
    { id: "spring", key: "n", label: "Spring", hints: ["Click one end of the spring.", "Click its other end."], accepts: [anywhere, elsewhere], make: two("spring") },
    { id: "force", key: "f", label: "Force", hints: ["Click where the force acts.", "Click where it points."], accepts: [onLink, elsewhere], make: ([at, to]) => [{ do: "force", at: ownPlace(at), to: to.at }] },
    { id: "interest", key: "i", label: "Point", hints: ["Click a link that gets a point, or a pin.", "Click where the point is; it may be next to the link."], accepts: [onLink, anywhere], isEarly: (target) => target.kind === "point", options: [["interest", "Show its path"], ["corner", "Corner only"]], make: pointed },
    { id: "delete", key: "x", label: "Delete", hints: ["Click what to delete: of a pin what holds it on the ground, its joints, then the pin."], accepts: [(target) => (target.kind === "free" ? "There is nothing to delete." : "")], hasMembers: true, make: ([target]) => deletions(target) },
];
export const toolOf = (id) => TOOLS.find((tool) => tool.id === id);

function bodiesOf([first, second]) {
    const [body] = moving(first);
    return [body, moving(second).find((one) => one !== body)];
}

function pinned([first, second]) {
    if (second) {
        const [a, b] = bodiesOf([first, second]);
        const name = (target, body) => target.points.find((one) => one.split(".")[0] === body) || target.point;
        return [{ do: "pin", points: [name(first, a), name(second, b)] }];
    }
    if (first.open?.length) return [{ do: "pin", points: first.open[0] }];
    return [{ do: "pin", at: placeOf(first), bodies: first.bodies.slice(0, 2) }];
}

function sliding([from, to], { option }) {
    const own = ownPlace(from);
    const [body] = moving(from);
    const on = moving(to).find((one) => one !== body);
    const along = on && to.along ? to.along : vector(from, to);
    const held = on ? { on } : {};
    return [{ do: "slider", point: own.point || own, along, ...held, ...(option === "block" ? { block: true } : {}) }];
}

function slotted([pin, from, to]) {
    const bodies = moving(pin);
    const body = bodies.length > 1 && bodies.find((one) => from.bodies.includes(one)) || moving(from).find((one) => one !== bodies[0]) || GROUND;
    const own = ownPlace({ ...pin, bodies: bodies.filter((one) => one !== body) });
    return [{ do: "slot", point: own.point || own, body, from: from.at, to: to.at }];
}

function pointed([link, place], { option }) {
    const at = place ? { body: moving(link)[0], at: place.at } : ownPlace(link);
    return option === "interest" ? [{ do: "interest", at }] : place ? [{ do: "point", ...at }] : [];
}

// Return operations that delete what a target is.
export function deletions(target) {
    if (target.kind === "member") return [{ do: "delete", place: [target.table, target.name] }];
    if (target.kind === "body") return [{ do: "delete", place: ["bodies", target.body] }];
    const joints = target.onGround?.length ? target.onGround : target.joints;
    if (joints.length) return joints.map((name) => ({ do: "delete", place: ["joints", name] }));
    const [body, point] = target.point.split(".");
    return [{ do: "delete", place: ["bodies", body, ...(target.isEnd ? [] : ["points", point])] }];
}

// Return the state of a tool that was just chosen.
export function chosen(id) {
    return { tool: id, picks: [], option: toolOf(id).options?.[0][0], number: null };
}

// Return from where lengths count, null without such a place.
export function baseOf({ tool, picks }) {
    return picks.length && !toolOf(tool).number ? picks[picks.length - 1].at : null;
}

// Return the state after a click on a target, operations, and why the target is refused: { state, operations, refusal }.
export function clicked(state, target) {
    const tool = toolOf(state.tool);
    const { picks } = state;
    const done = (operations, kept = []) => ({ state: { ...state, picks: kept }, operations, refusal: "" });
    if (tool.isChain && picks.length && distance(picks[0].at, target.at) === 0) return done([]); // a second click ends the chain
    const refusal = tool.accepts[picks.length](target, picks);
    if (refusal) return { state, operations: [], refusal };
    const all = [...picks, target];
    if (all.length < tool.accepts.length && !tool.isEarly?.(target)) return done([], all);
    return done(tool.make(all, state), tool.isChain && target.kind === "free" ? [target] : []);
}

// Return the state after Esc: first without the clicks so far, then with the tool for moving.
export function escaped(state) {
    return state.picks.length ? { ...state, picks: [] } : chosen("move");
}
