// Values as set, what can be undone, and the address of the page that holds them: a link is a design.

const MOST_STEPS = 200; // that can be undone

export class Design {
    constructor(linkage) {
        this.linkage = linkage;
        this.locked = new Set();
        this.past = [];
        this.future = [];
        this.values = new Map(linkage.bound);
        this.saved = new Map(this.values);
        this.start = linkage.u.slice(); // of the drivers
        this.failure = ""; // why the mechanism does not close with the values; it shows those before
        this.byName = new Map(linkage.parameters.map((one) => [one.name, one]));
    }

    get isOk() {
        return this.failure === "";
    }

    // Lock values, of these names, that this mechanism has.
    lock(names) {
        for (const name of names) if (this.byName.has(name)) this.locked.add(name);
    }

    // Set values of some parameters; they are one step to undo after `commit`.
    set(changes) {
        for (const [name, value] of Object.entries(changes)) this.values.set(name, value);
        return this.#bind();
    }

    #bind() {
        this.failure = this.linkage.setValues(this.values) ? "" : this.linkage.failure;
        this.isOtherBranch = !this.isOk && this.linkage.isOtherBranch;
        this.isInvalid = !this.isOk && this.linkage.isInvalid;
        return this.isOk;
    }

    commit() {
        if (same(this.values, this.saved)) return;
        this.past.push(this.saved);
        if (this.past.length > MOST_STEPS) this.past.shift();
        this.future = [];
        this.saved = new Map(this.values);
    }

    undo() {
        return this.#step(this.past, this.future);
    }

    redo() {
        return this.#step(this.future, this.past);
    }

    #step(from, to) {
        const values = from.pop();
        if (!values) return false;
        to.push(this.saved);
        this.saved = values;
        this.values = new Map(values);
        this.#bind();
        return true;
    }

    reset() {
        for (const one of this.linkage.parameters) this.values.set(one.name, one.value);
        this.#bind();
        this.commit();
    }

    changes() {
        return [...this.values].filter(([name, value]) => value !== this.byName.get(name).value);
    }

    // Return the part of the address after '#': changed parameters, then driver values.
    fragment() {
        const parts = this.changes().map(([name, value]) => `${encodeURIComponent(name)}=${value}`);
        this.linkage.data.drivers.forEach((driver, k) => {
            const value = this.linkage.wrapped(k);
            if (Math.abs(value - this.start[k]) > 1e-12) parts.push(`@${encodeURIComponent(driver.name)}=${value}`);
        });
        return parts.length ? `#${parts.join("&")}` : "";
    }

    // Take the design of an address; unknown names and numbers are ignored. Returns the names that were ignored.
    read(fragment) {
        const ignored = [];
        const values = new Map(this.linkage.parameters.map((one) => [one.name, one.value]));
        const u = this.start.slice();
        for (const part of fragment.replace(/^#/, "").split("&")) {
            if (!part) continue;
            const [key, text] = part.split("=");
            let name = key;
            try {
                name = decodeURIComponent(key.replace(/^@/, ""));
            } catch {
                ignored.push(key);
                continue;
            }
            const value = Number(text);
            const driver = this.linkage.data.drivers.findIndex((one) => one.name === name);
            if (text === undefined || text === "" || !Number.isFinite(value)) ignored.push(name);
            else if (key.startsWith("@") && driver >= 0) u[driver] = value;
            else if (!key.startsWith("@") && this.byName.has(name)) values.set(name, value);
            else ignored.push(name);
        }
        this.values = values;
        this.linkage.goTo(this.start); // where each design starts
        if (same(values, this.linkage.bound)) this.failure = "";
        else this.#bind();
        this.saved = new Map(values);
        if (this.isOk && !u.every((value, k) => value === this.linkage.u[k])) {
            this.linkage.t = this.linkage.timeNear(u);
            this.linkage.goTowards(u);
        }
        return ignored;
    }
}

function same(a, b) {
    return a.size === b.size && [...a].every(([name, value]) => b.get(name) === value);
}

const LATER = 300; // [ms] after the last move

export class Address {
    constructor(page) {
        this.page = page;
        window.addEventListener("hashchange", () => {
            if (location.hash === this.written) return;
            page.motion.blocked = "";
            this.read();
            page.reshape();
        });
    }

    // Take the design of the address; state names that this mechanism does not have.
    read() {
        const ignored = this.page.design.read(location.hash);
        if (ignored.length) this.page.hint(`The address names what this mechanism does not have: ${ignored.join(", ")}`);
    }

    write() {
        const fragment = this.page.design.fragment();
        this.written = fragment;
        try {
            history.replaceState(null, "", fragment || location.pathname + location.search);
        } catch {
            location.hash = fragment;
        }
    }

    writeSoon() {
        clearTimeout(this.writing);
        this.writing = setTimeout(() => this.write(), LATER);
    }
}
