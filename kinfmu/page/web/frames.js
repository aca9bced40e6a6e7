// The loop of frames: at most one drawing for each frame of the browser.

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
