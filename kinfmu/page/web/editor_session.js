// What the editor asks of the server: operations on the mechanism file, and the answers that are drawn.

export class Session {
    // take: is called with each answer
    constructor(take) {
        this.take = take;
        this.answer = null;
        this.waiting = Promise.resolve(); // until all requests so far are answered
    }

    get state() {
        return this.answer?.state;
    }

    load() {
        return this.#send("editor");
    }

    // Make operations; return { status, message }, the message if they are refused.
    operate(operations) {
        return this.#send("editor/operations", { operations });
    }

    // Undo, redo or save.
    step(what, more = {}) {
        return this.#send(`editor/${what}`, more);
    }

    // Return the data of the mechanism that moves, with its findings, or why there is none; null if it is out of date.
    async view() {
        const { state } = this;
        const { status, text } = await fetched(`editor/view?state=${state}`);
        if (this.state !== state || status === 204) return null;
        return status === 200 ? JSON.parse(text) : { view: null, message: text };
    }

    // Do something after all requests so far.
    next(work) {
        this.waiting = this.waiting.then(work, work);
        return this.waiting;
    }

    async #send(path, body = null) {
        const { status, text } = await fetched(path, body && { state: this.state, ...body });
        const answer = text.startsWith("{") ? JSON.parse(text) : null;
        if (answer && "sketch" in answer) {
            this.answer = answer;
            this.take(answer);
        }
        return { status, message: status === 200 ? "" : answer?.problem || text };
    }
}

async function fetched(path, body = null) {
    try {
        const answer = await fetch(path, body ? { method: "POST", body: JSON.stringify(body) } : {});
        return { status: answer.status, text: await answer.text() };
    } catch {
        return { status: 0, text: "kinfmu play has ended" };
    }
}
