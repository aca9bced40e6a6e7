// Run jobs with engine.js: { solver, jobs }, jobs a list of { module, calls: [[method, ...arguments]] } in JSON on standard input.
//
// Prints, for each job, what its calls return, in JSON; a number that JSON does not have is a text ("NaN"). "drag" is
// a method of this script: at(u, ud, udd) for each of many samples, with positions, rates and accelerations in a row.
import { readFileSync } from "node:fs";
import { compiled, Engine, unpacked } from "../../kinfmu/page/web/engine.js";

const plain = (key, value) => {
  if (typeof value === "number" && !Number.isFinite(value)) return String(value);
  return ArrayBuffer.isView(value) ? Array.from(value) : value;
};

function drag(engine, samples) {
  const statuses = [];
  const rows = samples.map(([u, ud, udd]) => {
    statuses.push(engine.at(u, ud, udd));
    return [...engine.q, ...engine.qd, ...engine.qdd];
  });
  return { rows, statuses };
}

const answers = [];
const { solver, jobs } = JSON.parse(readFileSync(0, "utf-8"));
const bytes = await unpacked(solver);
for (const { module, calls } of jobs) {
  const engine = await Engine.load(await compiled(bytes, readFileSync(module, "utf-8")));
  answers.push(
    calls.map(([name, ...given]) => {
      if (name === "drag") return JSON.parse(JSON.stringify(drag(engine, ...given), plain));
      const found = typeof engine[name] === "function" ? engine[name](...given) : engine[name];
      return JSON.parse(JSON.stringify(found, plain));
    }),
  );
}
process.stdout.write(JSON.stringify(answers));
