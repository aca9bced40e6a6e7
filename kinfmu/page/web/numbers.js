// Numbers as text, and round steps of scales.

export function niceStep(wanted) {
    const tens = 10 ** Math.floor(Math.log10(wanted));
    return [1, 2, 5, 10].find((step) => step * tens >= wanted) * tens;
}

export function number(value, digits = 5) {
    if (value === 0 || Math.abs(value) < 1e-13) return "0";
    return String(Number(value.toPrecision(digits)));
}

export function degrees(angle, decimals = 2) {
    return `${Number(((angle * 180) / Math.PI).toFixed(decimals)) + 0}\u00b0`;
}
