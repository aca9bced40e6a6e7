// The address of the page, whose part after '#' is the design and the pose: a link is a design.

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
