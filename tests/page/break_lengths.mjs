// Break each length of mechanisms until nothing closes: reads a list of files with the data of pages, in JSON, on standard
// input, and prints for each what `broken` returns.
import { readFileSync } from "node:fs";
import { Design } from "../../kinfmu/page/web/design.js";
import { compiled, Engine, unpacked } from "../../kinfmu/page/web/engine.js";
import { remainder } from "../../kinfmu/page/web/geometry.js";
import { Linkage } from "../../kinfmu/page/web/linkage.js";

const FACTORS = [0.5, 0.1, 2, 5, 20]; // of a length
const HALVINGS = 12; // between a length that closes and one that does not
const STEPS = 24; // from the length as written to one that does not close
const FINER = 64; // parts of a step in which a mechanism moves far
const TINY = 1e-6; // change of a length
const FAR = 0.25; // of the size or of a radian

// Return the largest change of a coordinate, relative to the size for lengths; whole turns do not count.
function apart(linkage, a, b) {
  const moved = ({ units }, k) => (units[0] === "rad" ? remainder(a[k] - b[k]) : (a[k] - b[k]) / linkage.data.size);
  return Math.max(0, ...linkage.part.outputs.map(moved).map(Math.abs));
}

// Return one entry for each length and driver value at which nothing closes with it.
function broken(linkage) {
  const found = [];
  const design = new Design(linkage);
  const [low, high] = linkage.ranges[0];
  for (const part of [0, 0.37]) {
    const u = linkage.u.slice();
    u[0] = part ? low + part * (high - low) : linkage.law[0].u[0];
    if (!linkage.goTo(u)) continue;
    for (const { name, value } of linkage.parameters.filter((one) => one.kind === "length" && !one.isLaw && one.value !== 0)) {
      const set = (factor) => design.set({ [name]: factor * value });
      const wrong = FACTORS.find((factor) => !set(factor));
      set(1);
      if (wrong === undefined) continue;
      const base = set(1 + TINY) ? 1 + TINY : 1; // the code whose lengths can be changed, if nothing is redundant
      set(base);
      const start = Array.from(linkage.pose.q);
      let [closes, breaks, before, largest] = [base, wrong, start, 0];
      const go = (to, count) => {
        const from = closes;
        for (let k = 1; k <= count; k += 1) {
          const factor = from + ((to - from) * k) / count;
          if (!set(factor)) return void (breaks = factor);
          const moved = apart(linkage, linkage.pose.q, before);
          if (moved > FAR && count === STEPS) {
            go(factor, FINER);
            if (closes !== factor) return;
          } else largest = Math.max(largest, moved);
          [closes, before] = [factor, Array.from(linkage.pose.q)];
        }
      };
      go(wrong, STEPS);
      for (let k = 0; k < HALVINGS; k += 1) {
        const middle = 0.5 * (closes + breaks);
        if (set(middle)) closes = middle;
        else breaks = middle;
      }
      set(closes);
      const kept = linkage.pose;
      const texts = [breaks, wrong].map((factor) => set(factor) || design.failure);
      const stays = linkage.pose === kept && linkage.bound.get(name) === closes * value && !design.isOk;
      set(closes);
      const recovers = design.isOk && apart(linkage, linkage.pose.q, kept.q);
      set(base);
      const returns = design.isOk && apart(linkage, linkage.pose.q, start);
      found.push({ name, u: u[0], factors: [closes, breaks, wrong], texts, stays, recovers, returns, largest });
      design.reset();
    }
  }
  return found;
}

const answers = [];
for (const path of JSON.parse(readFileSync(0, "utf-8"))) {
  const data = JSON.parse(readFileSync(path, "utf-8"));
  const solver = await unpacked(data.solver);
  const engines = {};
  for (const [which, part] of Object.entries(data.modules)) {
    const module = part && (await compiled(solver, part.text));
    engines[which] = part && [await Engine.load(module), await Engine.load(module)];
  }
  answers.push(broken(new Linkage(data, engines)));
}
process.stdout.write(JSON.stringify(answers));
