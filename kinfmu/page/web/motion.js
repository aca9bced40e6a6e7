// Motion over time, and the loop of frames in which it is drawn.

const ONCE = 6; // [s] of the motion that a page shows when it opens

export class Motion {
    constructor(page) {
        this.page = page;
        this.linkage = page.linkage;
        this.isPlaying = false;
        this.blocked = ""; // why the last move stopped
        this.hasStopped = false; // a play, where it cannot go on
        this.oncePace = 0; // of the motion that is shown once
    }

    play(isPlaying = !this.isPlaying) {
        this.oncePace = 0;
        this.isPlaying = isPlaying;
        this.page.transport.showPlaying(isPlaying);
        if (!isPlaying) {
            this.page.address.write();
            return;
        }
        const { linkage } = this;
        this.page.isToForesee = true;
        this.clock = null;
        if (this.hasStopped) this.#restart();
        if (linkage.data.over) {
            this.page.refresh();
            return;
        }
        const t = linkage.timeNear(linkage.u);
        linkage.t = t >= this.#end(t) - 1e-9 ? linkage.data.run.from : t;
        const law = linkage.driven(linkage.t).u;
        this.glide = linkage.u.map((value, k) => linkage.apart(k, value, law[k]));
        this.page.refresh();
    }

    // Move once through the motion, slowly, and back to its start; what stops a play ends it.
    showOnce() {
        if (this.page.linkage.data.over) return;
        this.play(true);
        const { from } = this.linkage.data.run;
        this.oncePace = (this.#end(from) - from) / ONCE;
    }

    #endOnce() {
        this.#restart();
        this.play(false);
    }

    #restart() {
        const { over, run } = this.linkage.data;
        if (over) this.move(over.driver, over.from);
        else this.arrive(this.linkage.goToTime(run.from));
    }

    // Stop a play that cannot go on.
    #stop() {
        if (!this.blocked) return;
        this.hasStopped = true;
        this.play(false);
    }

    // Go on in time to the frame that the browser shows now.
    advance(now) {
        const { linkage } = this;
        const { from, to } = linkage.data.run;
        const elapsed = this.clock === null ? 0 : Math.min((now - this.clock) / 1000, 0.1);
        this.clock = now;
        if (linkage.data.over) {
            this.#advanceDriver(elapsed * this.page.transport.speed);
            return;
        }
        let t = linkage.t + elapsed * (this.oncePace || this.page.transport.pace);
        if (t > this.#end(linkage.t)) {
            if (this.oncePace) {
                this.#endOnce();
                return;
            }
            t = from + ((t - from) % (to - from));
            if (!this.#repeats()) this.glide = null;
        }
        if (this.glide) {
            this.glide = this.glide.map((gap) => gap * Math.exp(-6 * elapsed));
            if (this.glide.every((gap) => Math.abs(gap) < 1e-9)) this.glide = null;
        }
        this.arrive(linkage.goToTime(t, this.glide));
        if (this.blocked && this.oncePace) this.#endOnce();
        else this.#stop();
    }

    // Go on along the values of the driver, all of them in the time of the run; after the last one it starts again.
    #advanceDriver(elapsed) {
        const { driver, from, to } = this.linkage.data.over;
        const { run } = this.linkage.data;
        const part = (this.linkage.u[driver] - from) / (to - from) + elapsed / (run.to - run.from);
        this.move(driver, from + (to - from) * (part > 1 ? 0 : Math.max(part, 0)));
        this.#stop();
    }

    // Note whether a pose was reached; values that did not close before may close there.
    arrive(isReached) {
        this.blocked = isReached ? "" : this.linkage.failure;
        if (isReached) {
            this.hasStopped = false;
            this.page.recover();
        }
        return isReached;
    }

    #repeats() {
        return this.linkage.turns.every(Boolean);
    }

    // Return where a play that is now at a time ends: after the run, or, beyond it, after the cycle of the driver.
    #end(t) {
        const { to } = this.linkage.data.run;
        return t > to ? this.linkage.cycleEnd : to;
    }

    // Move a driver to a value, as far as the mechanism goes.
    move(k, value) {
        const u = this.linkage.u.slice();
        u[k] = value;
        this.linkage.t = this.linkage.timeNear(u);
        return this.arrive(this.linkage.goTowards(u));
    }

    // Move to a place in a plot.
    pick(over, x) {
        this.play(false);
        this.page.refresh(() => {
            if (over === "driver") this.move(0, x);
            else this.arrive(this.linkage.goToTime(x));
        }, "place");
        this.page.address.writeSoon();
    }
}

const KEPT = 600; // times of frames

export class Frames {
    constructor(draw) {
        this.draw = draw; // draws; returns true if another frame follows
        this.times = []; // [ms] of scripting, of the last frames
        this.waiting = new Map();
        this.isAsked = false;
    }

    // Ask for a drawing in the next frame; work: what is done first, in the order of the calls. Work with a key takes the
    // place of work that still waits under this key: of many places of the hand within a frame, the last one counts.
    ask(work = null, key = Symbol("once")) {
        this.waiting.delete(key);
        if (work) this.waiting.set(key, work);
        if (this.isAsked) return;
        this.isAsked = true;
        requestAnimationFrame((now) => {
            const start = performance.now();
            const waiting = [...this.waiting.values()];
            this.waiting.clear();
            let goesOn = false;
            try {
                goesOn = this.draw(now, waiting);
            } finally {
                this.isAsked = false; // what this frame has changed, it has drawn
                if (goesOn || this.waiting.size) this.ask();
            }
            this.times.push(performance.now() - start);
            if (this.times.length > KEPT) this.times.shift();
        });
    }
}
