// Ranges of drivers and change points, and whether other values keep the branch that is shown.

import { isGood } from "./engine.js";
import { remainder, TURN } from "./geometry.js";
import { degrees, number } from "./numbers.js";

const TURNED = 360; // poses of a turn among which change points are looked for
const NEAR = 0.05; // margin of such a pose that is next to a change point
const SINGULAR = 1e-5; // margin at a change point
const MOST_TURNS = 12; // after which a mechanism may repeat, as for kinfmu check
const PHASES = 8; // of a turn at which poses are compared
const REPEATS = 1e-6; // [rad, sizes]; poses closer than this are equal

// Return { ranges, limits, turns }: of each driver, the others at the start of their laws; turns: after which the mechanism
// and its loads repeat, null without such a number.
export function rangesOf(linkage) {
    const start = Array.from(linkage.law[0].u);
    const limits = [];
    const { over } = linkage.data;
    const turns = linkage.data.drivers.map((driver, k) => (linkage.isChanged ? turnsOf(linkage, driver, k, start) : driver.turns));
    const ranges = linkage.data.drivers.map((driver, k) => {
        if (over?.driver === k) return [Math.min(over.from, over.to), Math.max(over.from, over.to)];
        const ends = reachOf(linkage, driver, k, start[k]).map((end) => endOf(linkage, start, k, end));
        for (const { at, isLimit } of ends) if (isLimit) limits.push({ driver: k, at });
        if (driver.kind === "angle" && !ends[0].isLimit && !ends[1].isLimit) return [start[k], start[k] + TURN * (turns[k] || 1)];
        return [ends[0].at, ends[1].at];
    });
    return { ranges, limits, turns };
}

// Return the turns of a driver after which the poses of a whole turn, and the loads, repeat; null if they do not.
function turnsOf(linkage, driver, k, start) {
    if (driver.kind !== "angle") return null;
    const u = Float64Array.from(start);
    const [ones, zeros] = [new Float64Array(u.length).fill(1), new Float64Array(u.length)];
    const poses = [];
    const isBack = (a, b) => linkage.part.outputs.every(({ units }, i) => Math.abs(units[0] === "rad" ? remainder(a[i] - b[i]) : (a[i] - b[i]) / linkage.data.size) < REPEATS);
    linkage.probe.restart();
    for (let turn = 0; turn <= MOST_TURNS; turn++) {
        for (let phase = 0; phase < PHASES; phase++) {
            u[k] = start[k] + TURN * (turn + phase / PHASES);
            if (!isGood(linkage.probe.at(u, ones, zeros))) return null;
            poses.push(linkage.probe.q.slice());
        }
        if (turn && poses.slice(0, PHASES).every((pose, phase) => isBack(pose, poses[turn * PHASES + phase]))) return leastCommonMultiple(turn, driver.loadTurns);
    }
    return null;
}

function leastCommonMultiple(a, b) {
    let most = Math.max(a, b);
    while (most % a || most % b) most += 1;
    return most;
}

// Return the change points { driver, at }: those that check states, or those found with other lengths.
export function changePointsOf(linkage) {
    return linkage.data.drivers.flatMap((driver, k) => {
        const found = linkage.isChanged ? changePoints(linkage, driver, k) : driver.changePoints;
        return found.map((at) => ({ driver: k, at }));
    });
}

// Return where a turning driver passes change points: the margin from singular poses is zero there.
function changePoints(linkage, driver, k) {
    if (driver.kind !== "angle") return [];
    const { probe } = linkage;
    const [low, high] = linkage.ranges[k];
    const u = Float64Array.from(linkage.law[0].u);
    const [ud, udd] = [new Float64Array(u.length).fill(1), new Float64Array(u.length)];
    const margin = (at) => {
        u[k] = at;
        return isGood(probe.at(u, ud, udd)) ? probe.margin : Infinity;
    };
    probe.restart();
    const step = (high - low) / TURNED;
    const margins = Array.from({ length: TURNED + 1 }, (_, i) => margin(low + i * step));
    const found = [];
    margins.forEach((value, i) => {
        const [before, after] = [margins[i - 1] ?? Infinity, margins[i + 1] ?? Infinity];
        if (value > NEAR || value > before || value >= after) return;
        let [a, b] = [low + Math.max(i - 1, 0) * step, low + Math.min(i + 1, TURNED) * step];
        while (b - a > 1e-9) {
            const [c, d] = [a + 0.382 * (b - a), a + 0.618 * (b - a)];
            if (margin(c) <= margin(d)) b = d;
            else a = c;
        }
        const at = 0.5 * (a + b);
        const isLimit = linkage.limits.some((limit) => limit.driver === k && Math.abs(limit.at - at) < step);
        const isKnown = found.some((other) => Math.abs(remainder(other - at)) < step); // the range may end where it starts
        if (!isLimit && !isKnown && margin(at) < SINGULAR) found.push(at);
    });
    return found;
}

function reachOf(linkage, driver, k, start) {
    if (driver.kind === "angle") return [start - TURN, start + TURN];
    const law = linkage.law.map((one) => one.u[k]);
    const [low, high] = [Math.min(...law), Math.max(...law)];
    const known = [...(driver.reach || []), ...driver.limits.map((limit) => limit.at), low, high];
    const [least, most] = [Math.min(...known), Math.max(...known)];
    const spare = Math.max(0.5 * (high - low), 0.02 * linkage.data.size);
    const limits = driver.limits.map((limit) => limit.at);
    return [
        limits.some((at) => at < low) ? least - 0.1 * (high - least) : Math.max(low - spare, least),
        limits.some((at) => at > high) ? most + 0.1 * (most - low) : Math.min(high + spare, most),
    ];
}

// Return how far one driver goes from its start towards an end, to 1e-9 of the way.
function endOf(linkage, start, k, end) {
    const steps = 120;
    const [ones, zeros] = [new Float64Array(start.length).fill(1), new Float64Array(start.length)];
    const at = (part) => start[k] + (end - start[k]) * part;
    if (end === start[k]) return { at: end, isLimit: false };
    const goes = (from, to, count) => {
        const u = Float64Array.from(start);
        linkage.probe.restart();
        for (let i = 0; i < count; i++) {
            u[k] = at(from + ((to - from) * (i + 1)) / count);
            if (!isGood(linkage.probe.at(u, ones, zeros))) return i;
        }
        return count;
    };
    const reached = goes(0, 1, steps);
    if (reached === steps) return { at: end, isLimit: false };
    let [low, high] = [reached / steps, (reached + 1) / steps];
    for (let i = 0; i < 6; i++) {
        const inner = goes(low, high, 16);
        [low, high] = [low + ((high - low) * inner) / 16, low + ((high - low) * (inner + 1)) / 16];
    }
    return { at: at(low), isLimit: true };
}

const SAME = 1e-6; // difference of equal poses, of the size and in radians
const HALVINGS = 12; // of the way on which branches part

// Bring engines that are not in use to values (vector) and to the driver values shown; return whether they come to the
// pose of the engine `there`, which is in use.
export function comesTo(linkage, which, vector, there) {
    const { data, engines, part, rates, u } = linkage;
    const [shown, probe] = engines[which];
    const isThere = isGood(there.at(u, rates.ud, rates.udd));
    if (!isThere || !probe.bind(vector).ok || !shown.bind(vector).ok || !isGood(shown.at(u, rates.ud, rates.udd))) return false;
    const [q, fixed] = [there.q, there.fixed()];
    const here = new Map([...part.outputs.map(({ name }) => name), ...part.fixed].map((name, k) => [name, k < q.length ? q[k] : fixed[k - q.length]]));
    return data.modules[which].outputs.every(({ name, units }, k) => {
        const gap = shown.q[k] - here.get(name);
        return Math.abs(units[0] === "rad" ? remainder(gap) : gap / data.size) < SAME;
    });
}

// Return where values (vector) lead to another branch, on the way of the drivers from the start of their laws to the pose
// shown; before: values of that pose, in the order of the engine `probe`.
export function partingOf(linkage, probe, before, vector) {
    const { data, law, rates } = linkage;
    const at = (part) => law[0].u.map((value, k) => value + part * (linkage.u[k] - value));
    probe.bind(before);
    const stays = (part) => {
        probe.restart();
        if (!isGood(probe.at(at(part), rates.ud, rates.udd)) || !probe.bind(vector, true).ok) return false;
        probe.bind(before);
        return true;
    };
    if (!stays(0)) return "with these values the mechanism is on another branch";
    let [same, other] = [0, 1];
    for (let k = 0; k < HALVINGS; k += 1) {
        const middle = 0.5 * (same + other);
        if (stays(middle)) same = middle;
        else other = middle;
    }
    const reached = at(other);
    const text = data.drivers.map(({ name, kind, unit }, k) => `${name} = ${kind === "angle" ? degrees(reached[k], 1) : `${number(reached[k], 4)} ${unit}`}`);
    return `with these values the mechanism moves on another branch beyond ${text.join(", ")}`;
}
