/** Play: characters that the user steers, pushes and throws balls at. */
import { button, el, select } from "../app/dom";
import { policy } from "../app/engine";
import { integer, optionsOf } from "../app/route";
import type { Context, View } from "../app/view";
import { CHARACTERS, characterOf } from "../views/characters";
import { Player } from "./player";

/** Largest seed of a link. */
const MOST = 2 ** 31 - 1;

export interface PlayView extends View {
  readonly player: Player;
}

export async function makePlay(context: Context): Promise<PlayView> {
  const { panel, params } = context;
  const character = characterOf(params.get("agent"));
  const seed = integer(params, "seed", 0, MOST, 0);
  const bytes = await policy(character.policy);
  const go = (name: string): void => context.open("play", { agent: name });
  const next = (): void => {
    const at = CHARACTERS.indexOf(character);
    go(CHARACTERS[(at + 1) % CHARACTERS.length]?.name ?? character.name);
  };
  context.stay();
  const options = optionsOf(params);
  const given = Object.keys(options).length > 0 ? { options } : {};
  const player = new Player(context, {
    agent: character.agent,
    env: { policy: bytes, seed, ...given },
    distance: character.distance,
    skin: character.skin,
    next,
  });
  const choices = CHARACTERS.map(({ name, label }) => ({ value: name, label }));
  const reseed = (): void => {
    const now = Math.floor(Math.random() * 1e6);
    context.link({ seed: String(now) });
    player.arena.reset(now);
    context.say(`Seed ${now}`);
  };
  panel.replaceChildren(
    el("h2", {}, "Play"),
    select("Character", choices, character.name, go),
    character.name === "Course" ? el("p", {}, "The walker finds its way by itself. Each seed is another course.") : "",
    player.controls,
    el("div", { class: "row" }, button("New seed", reseed), player.arena.takesCommands && button("Autopilot", () => player.act("release"), { title: "The commands come from the task's own schedule" })),
  );
  return { player, dispose: () => player.dispose() };
}
