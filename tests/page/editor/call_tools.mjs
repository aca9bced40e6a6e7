// Calls functions of the editor of pages, whose modules need no page, and prints what they return as JSON.
//
// Input: [[module, function, [arguments]], ...]; an argument { sketch: data } becomes a sketch, { chain: [[tool], targets] } what
// the machine makes of clicks: { operations, refusals, picks } after each.

import { pathToFileURL } from "node:url";

const [, , folder] = process.argv;
const of = (name) => import(pathToFileURL(`${folder}/${name}.js`).href);
const [{ Sketch }, tools] = [await of("editor_sketch"), await of("editor_tools")];
let text = "";
for await (const part of process.stdin) text += part;

function clicks([id, targets, more = {}]) {
    let state = { ...tools.chosen(id), ...more };
    return targets.map((target) => {
        const found = tools.clicked(state, target);
        state = found.state;
        return { operations: found.operations, refusal: found.refusal, picks: state.picks.length };
    });
}

const found = [];
for (const [module, name, values] of JSON.parse(text)) {
    const taken = values.map((value) => (value?.sketch ? new Sketch(value.sketch) : value));
    found.push(module === "clicks" ? clicks(taken) : (await of(module))[name](...taken));
}
console.log(JSON.stringify(found));
