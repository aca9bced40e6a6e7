// Numbers as text, and messages of the engine in the words of the page.

export function niceStep(wanted) {
    const tens = 10 ** Math.floor(Math.log10(wanted));
    return [1, 2, 5, 10].find((step) => step * tens >= wanted) * tens;
}

export function number(value, digits = 5) {
    if (value === 0 || Math.abs(value) < 1e-13) return "0";
    return String(Number(value.toPrecision(digits)));
}

// Return how many decimals a number in a range needs for `steps` different texts.
export function decimals(range, steps) {
    return range > 0 ? Math.min(Math.max(Math.ceil(Math.log10(steps / range)), 0), 15) : 0;
}

export function degrees(angle, decimals = 2) {
    return `${Number(((angle * 180) / Math.PI).toFixed(decimals)) + 0}\u00b0`;
}

// Return the members of each group, by what key gives for them.
export function grouped(members, key) {
    const found = new Map();
    for (const one of members) {
        const name = key(one);
        if (found.has(name)) found.get(name).push(one);
        else found.set(name, [one]);
    }
    return found;
}

// Return a text with a full stop at its end; names at its begin keep their letters.
export function withStop(text) {
    return `${text.replace(/[.]$/, "")}.`;
}

const ROWS = /(?:redundant )?\b(rows?) ([\w.]+(?:, [\w.]+)*) (do not close|does not close|closes?|are dependent)/gi;
const VERBS = { "do not close": "does not close", close: "closes" }; // of several, of one

// Return a message in which "rows C.x, C.y do not close" is "joint C does not close", with a limit in few digits; drivers:
// their names.
export function ofJoints(message, drivers = []) {
    const short = message.replace(/the limit is .*/, (text) => text.replace(/\d+\.\d+/g, (digits) => number(Number(digits), 6)));
    return short.replace(ROWS, (_, __, rows, verb) => {
        const owners = [...new Set(rows.split(", ").map((row) => row.split(".")[0]))];
        const kinds = [["joint", owners.filter((name) => !drivers.includes(name))], ["driver", owners.filter((name) => drivers.includes(name))]];
        const named = kinds.filter(([, names]) => names.length).map(([kind, names]) => `${kind}${names.length > 1 ? "s" : ""} ${listed(names)}`).join(" and ");
        if (verb === "are dependent") return `the equations of ${named} are dependent`;
        const [several, one] = Object.entries(VERBS).find((forms) => forms.includes(verb));
        return `${named} ${owners.length > 1 ? several : one}`;
    });
}

function listed(names) {
    return names.length > 1 ? `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}` : names[0];
}
