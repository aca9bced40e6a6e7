// Branches: whether other values keep the branch that is shown, and from which pose on they do not.

import { isGood } from "./engine.js";
import { remainder } from "./geometry.js";
import { degrees, number } from "./numbers.js";

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
