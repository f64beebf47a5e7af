/** The characters that can be steered. */

export interface Character {
  /** Name in links. */
  readonly name: string;
  readonly label: string;
  readonly agent: string;
  /** File of the policy. */
  readonly policy: string;
  /** File of the skin, if it has one. */
  readonly skin: string | null;
  /** Distance of the camera, m. */
  readonly distance: number;
}

export const CHARACTERS: readonly Character[] = [
  { name: "MarathonMan", label: "Marathon Man", agent: "MarathonManController-v0", policy: "MarathonManController", skin: "MarathonMan", distance: 4.6 },
  { name: "Walker", label: "Walker", agent: "WalkerController-v0", policy: "WalkerController", skin: "Walker", distance: 5.2 },
  { name: "Ant", label: "Ant", agent: "AntController-v0", policy: "AntController", skin: "Ant", distance: 5.0 },
  { name: "Hopper", label: "Hopper", agent: "HopperController-v0", policy: "HopperController", skin: "Hopper", distance: 4.6 },
  { name: "Course", label: "Course (Walker)", agent: "TerrainWalker2d-v0", policy: "TerrainWalker2d", skin: "Walker", distance: 5.4 },
];

/** The task in which Marathon Man follows clips, and its policy. */
export const FOLLOWER = { agent: "MarathonMan-v0", policy: "MarathonMan" };

/** Policies that come with the page and can be chosen. */
export const POLICIES = ["hopper", "walker2d", "ant", ...CHARACTERS.map(({ policy }) => policy)];

/** The character of a name; without one, Marathon Man. */
export function characterOf(name: string | null): Character {
  const found = CHARACTERS.find((character) => character.name === (name ?? CHARACTERS[0]?.name));
  if (found) return found;
  throw new Error(`agent is '${name}', expected ${CHARACTERS.map((character) => character.name).join(", ")}`);
}

/** The skin of a task's body, by the names of its bodies. */
export function skinOf(bodies: readonly string[]): string | null {
  if (bodies.includes("lower_waist") && bodies.includes("right_larm")) return "MarathonMan";
  if (bodies.includes("front_left_leg")) return "Ant";
  if (bodies.includes("right_leg") && bodies.includes("left_leg")) return "Walker";
  if (bodies.includes("calf") && bodies.includes("pelvis")) return "Hopper";
  return null;
}
