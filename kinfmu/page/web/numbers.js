// Numbers as text, and round steps of scales.

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
