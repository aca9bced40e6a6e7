// The panel of values: a slider, a number field and a lock for each; lengths of links first.

import { css } from "./pen.js";
import { distance, isSlim } from "./geometry.js";
import { grouped, number } from "./numbers.js";
import { breakable, element, shownUnit } from "./elements.js";

const AXES = ["x", "y"];
const MOST_VALUES = 40; // values at the top of the panel

// Return the lengths of links, which are no numbers of the file: of each two points of a body, or from the first point of a
// body with many. { label, short, body, names, read(values), changes(value, values) }; the second point moves along.
function lengthsOf({ data, parameters }) {
    const known = new Map(parameters.filter((one) => one.isPlace).map((one) => [one.name, one]));
    const found = [];
    for (const [body, all] of grouped(data.points, (point) => point.body)) {
        const points = all.map(({ name, x, y }) => ({ name, at: [x, y], names: AXES.map((axis) => `bodies.${body}.points.${name}.${axis}`) }));
        const used = points.filter(({ at }, k) => points.findIndex((other) => distance(at, other.at) < 1e-9 * data.size) === k);
        const isPlate = used.length === 3 && !isSlim(used.map(({ at }) => at), 1e-6 * data.size);
        const pairs = used.flatMap((a, k) => used.slice(k + 1).map((b) => [a, b])).filter(([a]) => isPlate || a === used[0]);
        for (const [a, b] of pairs) {
            if (!b.names.every((name) => known.has(name))) continue;
            const ends = (values) => [a, b].map(({ at, names }) => names.map((name, k) => values.get(name) ?? at[k]));
            const between = `${a.name}\u2013${b.name}`;
            const changes = (value, values) => {
                const [from, to] = ends(values);
                const now = distance(from, to);
                return Object.fromEntries(b.names.map((name, k) => [name, now ? from[k] + ((to[k] - from[k]) * value) / now : to[k] + value * (1 - k)]));
            };
            const names = [...b.names, ...a.names.filter((name) => known.has(name))];
            const more = pairs.length > 1 ? { label: `${body} ${between}`, description: between } : { label: `${body} length`, description: "" };
            found.push({ ...more, short: body, body, kind: "length", unit: data.unit, value: distance(a.at, b.at), names, read: (values) => distance(...ends(values)), changes });
        }
    }
    return found;
}

// Return what the panel has of a number of the file; body: the only one whose points depend on it.
function ofNumber(one) {
    const [body, ...others] = new Set(one.points.map((point) => point.split(".")[0]));
    const isOwn = body && !others.length;
    return { ...one, body: isOwn ? body : null, description: one.description || (isOwn && !one.isPlace ? body : ""), names: [one.name], read: (values) => values.get(one.name), changes: (value) => ({ [one.name]: value }) };
}

export class Values {
    constructor(page, root) {
        this.page = page;
        this.rows = [];
        this.isReady = false;
        const { linkage } = page;
        const { samples, drivers, closedNumbers } = linkage.data; // samples of a record: the laws of its drivers do not move it
        const all = linkage.parameters.map(ofNumber);
        const places = all.filter((one) => one.isPlace);
        const laws = all.filter((one) => one.isLaw && !(samples && drivers.some(({ name }) => one.name.startsWith(`${name}.`))));
        if (!all.length && !closedNumbers) root.append(element("p", { className: "quiet", textContent: "This mechanism has no numbers to change." }));
        const ofJoints = places.filter((one) => one.name.startsWith("joints.") && one.kind === "length" && one.value);
        const first = [...all.filter((one) => !one.isPlace && !one.isLaw), ...lengthsOf(linkage), ...ofJoints];
        const shown = first.slice(0, MOST_VALUES);
        shown.forEach((one) => root.append(this.#row(one)));
        if (laws.length) root.append(this.#group("Motion of the drivers", laws, !first.length));
        if (first.length > MOST_VALUES) root.append(this.#group("More lengths", first.slice(MOST_VALUES), false));
        if (places.length) root.append(this.#numbers(places));
        if (closedNumbers) root.append(element("p", { className: "quiet", textContent: `The file has ${closedNumbers} coordinates of points and numbers of joints. They can be changed in the file; the pages of files with at most 400 change them too.` }));
        this.isReady = true;
        this.update();
    }

    // Return all numbers of the file, by the bodies and joints that have them.
    #numbers(places) {
        const details = element("details", {}, element("summary", { textContent: "All numbers of the file" }));
        for (const [name, members] of grouped(places, (one) => one.group)) {
            const sizes = members.filter((one) => one.value !== 0);
            const zeros = members.filter((one) => one.value === 0);
            const group = this.#group(name, sizes.length ? sizes : zeros, false);
            if (sizes.length && zeros.length) group.append(this.#group(`coordinates of ${name} that are 0`, zeros, false));
            details.append(group);
        }
        return details;
    }

    // A group is filled when it opens, since long chains have thousands of numbers.
    #group(title, members, isOpen) {
        const details = element("details", { open: isOpen }, element("summary", { textContent: title }));
        const fill = () => {
            if (!details.open || details.filled) return;
            details.filled = true;
            details.querySelector("summary").after(...members.map((one) => this.#row(one)));
            this.update();
        };
        details.addEventListener("toggle", fill);
        if (isOpen) fill();
        return details;
    }

    #row(one) {
        const { page } = this;
        const { unit, factor } = shownUnit(one.unit);
        const usual = Math.abs(one.value) || (one.kind === "angle" ? 1 : one.kind === "length" ? 0.3 * page.linkage.data.size : 1);
        const [low, high] = one.value === 0 ? [-usual, usual] : [one.value - 0.6 * usual, one.value + 0.6 * usual];
        const text = element("div", { className: "text" }, ...this.#swatch(one.body), breakable(one.short));
        if (one.description) text.append(element("small", { textContent: one.description }));
        const field = element("input", { type: "number", step: "any", "aria-label": `${one.label} ${unit}` });
        const slider = element("input", { type: "range", min: low * factor, max: high * factor, step: "any", "aria-label": `${one.label}, slider` });
        const { locked } = page.design;
        const isLocked = () => one.names.every((name) => locked.has(name));
        const lock = element("button", { className: "lock", "aria-pressed": "false", title: `Keep ${one.label} while pins are dragged`, "aria-label": `Lock ${one.label}` });
        lock.innerHTML = '<svg viewBox="0 0 20 20"><rect x="4" y="9" width="12" height="8" rx="1.5"/><path d="M7 9V6a3 3 0 0 1 6 0v3"/></svg>';
        lock.addEventListener("click", () => {
            const was = isLocked();
            for (const name of one.names) if (was) locked.delete(name); else locked.add(name);
            this.update();
        });
        const set = (value) => page.setValues(one.changes(value / factor, page.design.values));
        slider.addEventListener("input", () => set(Number(slider.value)));
        slider.addEventListener("change", () => page.commit());
        field.addEventListener("change", () => {
            const value = Number(field.value);
            const isNumber = field.value.trim() !== "" && Number.isFinite(value);
            field.classList.toggle("wrong", !isNumber);
            if (!isNumber) return;
            set(value);
            page.commit();
        });
        const parts = [text, slider, field, element("span", { className: "unit", textContent: unit })];
        const row = element("div", { className: "value" }, ...parts, one.isLaw ? element("span") : lock);
        this.rows.push({ row, field, slider, lock, isLocked, factor, one });
        return row;
    }

    // Return the colour of a body, as the drawing has it.
    #swatch(body) {
        const colour = this.page.linkage.data.bodies.find(({ name }) => name === body)?.colour;
        if (!colour) return [];
        const swatch = element("span", { className: "swatch" });
        swatch.style.background = css(colour);
        return [swatch];
    }

    update() {
        if (!this.isReady) return;
        const { design, linkage } = this.page;
        for (const { row, field, slider, lock, isLocked, factor, one } of this.rows) {
            const value = one.read(design.values);
            const shown = number(value * factor, 9);
            if (field.value !== shown) field.value = shown;
            if (document.activeElement !== slider) slider.value = value * factor;
            lock.setAttribute("aria-pressed", String(isLocked()));
            row.classList.toggle("changed", one.names.some((name) => design.values.get(name) !== design.byName.get(name).value));
            field.classList.toggle("wrong", !design.isOk && one.names.some((name) => design.values.get(name) !== linkage.bound.get(name)));
        }
    }
}
