// Elements of the page, and how names and units are shown.

const DEGREE = 180 / Math.PI;

export function $(id) {
    return document.getElementById(id);
}

export function element(tag, properties = {}, ...children) {
    const made = document.createElement(tag);
    for (const [key, value] of Object.entries(properties)) {
        if (key.includes("-") || key === "for" || key === "role") made.setAttribute(key, value);
        else made[key] = value;
    }
    made.append(...children);
    return made;
}

// Give an element a label, unless it has it: screen readers speak each change.
export function describe(one, label) {
    if (one.ariaLabel !== label) one.ariaLabel = label;
}

// Return how a unit is shown and edited: angles in degrees.
export function shownUnit(unit) {
    return unit.startsWith("rad") ? { unit: unit.replace("rad", "deg"), factor: DEGREE } : { unit, factor: 1 };
}

// Return a name that may be broken after each "_".
export function breakable(name) {
    return name.replaceAll("_", "_\u200b");
}
