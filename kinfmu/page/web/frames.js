// The loop of frames: at most one drawing for each frame of the browser.

const KEPT = 600; // times of frames

export class Frames {
    constructor(draw) {
        this.draw = draw; // draws; returns true if another frame follows
        this.times = []; // [ms] of scripting, of the last frames
        this.work = null;
        this.isAsked = false;
    }

    // Ask for a drawing in the next frame; work: what is done first, instead of work that still waits.
    ask(work = null) {
        if (work) this.work = work;
        if (this.isAsked) return;
        this.isAsked = true;
        requestAnimationFrame((now) => {
            this.isAsked = false;
            const start = performance.now();
            const waiting = this.work;
            this.work = null;
            const goesOn = this.draw(now, waiting);
            this.times.push(performance.now() - start);
            if (this.times.length > KEPT) this.times.shift();
            if (goesOn) this.ask();
        });
    }
}
