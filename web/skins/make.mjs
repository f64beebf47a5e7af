// Makes public/skins: smooth surfaces by `marathon skin`, and Marathon Man's own skin. Needs crates/wasm/npm/dist.
//
//   node web/skins/make.mjs path/to/marathon
//
// In the page a bone is fixed to a body: it moves as the body does. So the inverse bind matrices begin at the bodies, and not at the
// joints as in the files that the game reads. `extras.body` names the body of a bone.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { load } from "marathon-rl";
import { Matrix4, Vector3 } from "three";

const program = process.argv[2] ?? "marathon";
const root = fileURLToPath(new URL("../../", import.meta.url));
const out = fileURLToPath(new URL("../public/skins/", import.meta.url));
const folder = mkdtempSync(join(tmpdir(), "skin-"));
const marathon = await load({ lanes: "exact" });

/** A generated skin. */
function generate(model, triangles) {
  const file = join(folder, `${model}.glb`);
  execFileSync(program, ["skin", model, "--out", file, "--triangles", String(triangles)]);
  return parse(file);
}

function parse(path) {
  const bytes = readFileSync(path);
  const length = bytes.readUInt32LE(12);
  return { json: JSON.parse(bytes.subarray(20, 20 + length).toString()), binary: Buffer.from(bytes.subarray(28 + length)) };
}

function write(name, { json, binary }) {
  let text = Buffer.from(JSON.stringify(json));
  text = Buffer.concat([text, Buffer.alloc((4 - (text.length % 4)) % 4, " ")]);
  const header = Buffer.alloc(20);
  header.write("glTF", 0);
  [2, 28 + text.length + binary.length, text.length].forEach((x, i) => header.writeUInt32LE(x, 4 + 4 * i));
  header.write("JSON", 16);
  const chunk = Buffer.alloc(8);
  chunk.writeUInt32LE(binary.length, 0);
  chunk.write("BIN\0", 4);
  writeFileSync(`${out}${name}.glb`, Buffer.concat([header, text, chunk, binary]));
}

/** Places of the bones of a skin at rest, by name. They are not turned. */
function bones({ json }) {
  const parent = new Map(json.nodes.flatMap((node, i) => (node.children ?? []).map((child) => [child, i])));
  const place = (i) => {
    const at = new Vector3(...(json.nodes[i].translation ?? [0, 0, 0]));
    return parent.has(i) ? at.add(place(parent.get(i))) : at;
  };
  return new Map(json.skins[0].joints.map((i) => [json.nodes[i].name, place(i)]));
}

/** Places of the bodies of a task at rest, by name, in the axes of glTF. The first one is where `first` says. */
function bodies(agent, first) {
  const env = marathon.env(agent);
  const qpos = new Float64Array(env.model.nq);
  if (env.model.nq === env.model.nv + 1) qpos[3] = 1;
  env.setState(0, qpos, new Float64Array(env.model.nv));
  const poses = env.bodyPoses();
  const place = (i) => new Vector3(poses[16 * i + 13], poses[16 * i + 14], poses[16 * i + 12]);
  const shift = first.clone().sub(place(1));
  return new Map(env.model.bodies.map(({ name }, i) => [name, place(i).add(shift)]));
}

/** Fixes the bones of a skin to bodies. `fitted` puts the skin on the model at rest. */
function fix({ json, binary }, places, bodyOf, fitted = new Matrix4()) {
  const [{ joints, inverseBindMatrices }] = json.skins;
  const { bufferView, byteOffset = 0 } = json.accessors[inverseBindMatrices];
  const start = (json.bufferViews[bufferView].byteOffset ?? 0) + byteOffset;
  for (const [i, joint] of joints.entries()) {
    const body = bodyOf(json.nodes[joint].name);
    const inverse = new Matrix4().makeTranslation(places.get(body).clone().negate()).multiply(fitted);
    inverse.elements.forEach((x, k) => binary.writeFloatLE(x, start + 64 * i + 4 * k));
    json.nodes[joint].extras = { body };
  }
}

for (const [name, model, agent, triangles] of [
  ["Ant", "ant", "Ant-v0", 4000],
  ["Hopper", "hopper", "Hopper-v0", 6000],
  ["Walker", "walker2d", "Walker2d-v0", 7000],
]) {
  const skin = generate(model, triangles);
  fix(skin, bodies(agent, bones(skin).get("torso")), (bone) => bone);
  write(name, skin);
}

/** The body that each bone of Marathon Man's skin is fixed to. */
const BODIES = { Hips: "butt", Spine: "lower_waist", Chest: "torso", Neck: "torso", Head: "torso" };
for (const [side, name] of [["Left", "left"], ["Right", "right"]]) {
  Object.assign(BODIES, {
    [`${side}Arm`]: `${name}_upper_arm`,
    [`${side}ForeArm`]: `${name}_larm`,
    [`${side}Hand`]: `${name}_larm`,
    [`${side}UpLeg`]: `${name}_thigh`,
    [`${side}Leg`]: `${name}_shin`,
    [`${side}Foot`]: `${name}_foot`,
  });
}
const man = parse(`${root}assets/skins/marathon_man.glb`);
const places = bodies("MarathonMan-v0", new Vector3());
const middle = (map, a, b) => map.get(a).clone().add(map.get(b)).multiplyScalar(0.5);
// it was made for this model: where the hips are in place, the other joints are
const fitted = new Matrix4().makeTranslation(middle(places, "left_thigh", "right_thigh").sub(middle(bones(man), "LeftUpLeg", "RightUpLeg")));
for (const [bone, place] of bones(man)) {
  const apart = place.clone().applyMatrix4(fitted).distanceTo(places.get(BODIES[bone]));
  if (/(Arm|Leg|Foot)$/.test(bone) && apart > 0.01) throw new Error(`${bone} is ${apart} m from its body`);
}
fix(man, places, (bone) => BODIES[bone], fitted);
write("MarathonMan", man);
