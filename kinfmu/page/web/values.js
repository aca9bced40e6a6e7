// The panel of values: a slider, a number field and a lock for each.

import { grouped, number } from "./numbers.js";
import { breakable, element, shownUnit } from "./elements.js";

export class Values {
    constructor(page, root) {
        this.page = page;
        this.rows = new Map();
        this.isReady = false;
        const { linkage } = page;
        const own = linkage.parameters.filter((one) => !one.isPlace && !one.isLaw);
        const places = linkage.parameters.filter((one) => one.isPlace);
        const { samples, drivers } = linkage.data; // of a record: the laws of its drivers do not move it
        const laws = linkage.parameters.filter((one) => one.isLaw && !(samples && drivers.some(({ name }) => one.name.startsWith(`${name}.`))));
        if (!linkage.parameters.length && !linkage.data.closedNumbers) root.append(element("p", { className: "quiet", textContent: "This mechanism has no numbers to change." }));
        own.forEach((one) => root.append(this.#row(one)));
        const groups = grouped(places, (one) => one.group);
        const isOpen = !own.length && places.length <= 60;
        for (const [name, members] of groups) {
            const sizes = members.filter((one) => one.value !== 0);
            const zeros = members.filter((one) => one.value === 0);
            const group = this.#group(name, sizes.length ? sizes : zeros, isOpen);
            if (sizes.length && zeros.length) group.append(this.#group(`coordinates of ${name} that are 0`, zeros, false));
            root.append(group);
        }
        if (laws.length) root.append(this.#group("Laws of the drivers", laws, false));
        const { closedNumbers } = linkage.data;
        if (closedNumbers) root.append(element("p", { className: "quiet", textContent: `The file has ${closedNumbers} coordinates of points and numbers of joints. They can be changed in the file; the pages of files with at most 400 change them too.` }));
        this.isReady = true;
        this.update();
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
        const text = element("div", { className: "text", textContent: breakable(one.short) });
        if (one.description) text.append(element("small", { textContent: one.description }));
        const field = element("input", { type: "number", step: "any", "aria-label": `${one.label} ${unit}` });
        const slider = element("input", { type: "range", min: low * factor, max: high * factor, step: "any", "aria-label": `${one.label}, slider` });
        const lock = element("button", { className: "lock", "aria-pressed": "false", title: `Keep ${one.label} while pins are dragged`, "aria-label": `Lock ${one.label}` });
        lock.innerHTML = '<svg viewBox="0 0 20 20"><rect x="4" y="9" width="12" height="8" rx="1.5"/><path d="M7 9V6a3 3 0 0 1 6 0v3"/></svg>';
        lock.addEventListener("click", () => {
            const isLocked = !page.design.locked.has(one.name);
            if (isLocked) page.design.locked.add(one.name);
            else page.design.locked.delete(one.name);
            lock.setAttribute("aria-pressed", String(isLocked));
        });
        const set = (value) => page.setValue(one.name, value / factor);
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
        this.rows.set(one.name, { row, field, slider, factor, one });
        return row;
    }

    update() {
        if (!this.isReady) return;
        for (const [name, { row, field, slider, factor, one }] of this.rows) {
            const value = this.page.design.values.get(name);
            const shown = number(value * factor, 9);
            if (field.value !== shown) field.value = shown;
            if (document.activeElement !== slider) slider.value = value * factor;
            row.classList.toggle("changed", value !== one.value);
            field.classList.toggle("wrong", !this.page.design.isOk && value !== this.page.linkage.bound.get(name));
        }
    }
}
