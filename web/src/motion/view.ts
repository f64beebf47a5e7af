/** Motion: a recording becomes a clip of Marathon Man, which can be saved and which the character can follow. */
import { type Clip, MarathonError } from "marathon-rl";
import { button, download, el, slider, toggle } from "../app/dom";
import { fetchBytes, pageUrl, policy } from "../app/engine";
import { type GivenFile, baseName, extension, fileButton } from "../app/files";
import { type Context, type View, shown } from "../app/view";
import { Keyboard } from "../input/keyboard";
import { NO_HANDS, PointerControl } from "../input/pointer";
import { Player } from "../play/player";
import { FOLLOWER } from "../views/characters";
import { ClipPlayer } from "./clip";
import { type Import, startImport } from "./import";
import { CLIPS } from "./samples";

const CHARACTER = "MarathonMan";
/** Largest recording, bytes. */
const MOST = 64e6;

const RECORDING = /^(bvh|glb|gltf|vrm|vrma|motion)$/;

class Motion implements View {
  readonly #context: Context;
  readonly #main = el("div", { class: "stack" });
  #player: ClipPlayer | null = null;
  #follower: Player | null = null;
  #pointer: PointerControl | null = null;
  #keyboard: Keyboard | null = null;
  #import: Import | null = null;

  constructor(context: Context) {
    this.#context = context;
    context.stage.canvas.setAttribute("aria-label", "Picture of the clip. Drag to look around; Enter pauses.");
  }

  async show(): Promise<void> {
    const { panel, stay } = this.#context;
    panel.replaceChildren(el("h2", {}, "Motion"), this.#main);
    this.#fill();
    const [recording, files] = await this.#find();
    stay();
    if (extension(recording.path) === "motion") this.#show(recording.path, recording.bytes, []);
    else void this.#read(recording, files);
  }

  /** Whether a recording is being imported. */
  get busy(): boolean {
    return this.#import !== null;
  }

  dispose(): void {
    this.#import?.stop();
    this.#keyboard?.dispose();
    this.#pointer?.dispose();
    this.#follower?.dispose();
    this.#player?.dispose();
  }

  async #find(): Promise<[GivenFile, readonly GivenFile[]]> {
    const { files, params } = this.#context;
    const given = files.find(({ path }) => RECORDING.test(extension(path)));
    if (given) return [given, files];
    const address = params.get("motion") ?? CLIPS[0];
    const known = CLIPS.some((name) => name === address);
    const url = known ? pageUrl(`motions/${address}.motion`) : new URL(address, document.baseURI);
    if (!/^https?:$/.test(url.protocol)) throw new Error(`${address} is not an address of the web`);
    return [{ path: baseName(url.pathname), bytes: await fetchBytes(url, MOST) }, []];
  }

  /** Imports a recording, and shows the clip when it is there. */
  async #read({ path, bytes }: GivenFile, files: readonly GivenFile[]): Promise<void> {
    const { marathon, stay, giveUp } = this.#context;
    const name = baseName(path);
    const beside = Object.fromEntries(files.filter((file) => file.path !== path).map((file) => [baseName(file.path), file.bytes]));
    this.#main.replaceChildren(el("h3", {}, name), el("p", { role: "status", class: "notice" }, "Fitting the motion to Marathon Man. A long recording takes minutes."));
    try {
      this.#import = startImport(marathon, { character: CHARACTER, name, bytes, files: beside });
      const { motion, warnings } = await this.#import.result;
      stay();
      this.#show(name, motion, warnings);
    } catch (error) {
      giveUp(error);
    } finally {
      this.#import = null;
    }
  }

  #show(path: string, motion: Uint8Array, warnings: readonly string[]): void {
    const name = baseName(path);
    const clip = this.#context.marathon.importMotion(CHARACTER, name.replace(/\.[^.]*$/, ".motion"), motion);
    this.#play(clip);
    this.#main.replaceChildren(this.#about(clip, name, warnings));
  }

  #play(clip: Clip): void {
    const { stage } = this.#context;
    this.#player = new ClipPlayer(stage, clip);
    this.#pointer = new PointerControl(stage, NO_HANDS);
    stage.show(this.#player);
  }

  #about(clip: Clip, file: string, problems: readonly string[]): HTMLElement {
    const { name, duration, frames, loop } = clip.info;
    const player = this.#player;
    const scrub = slider({
      label: "Time",
      low: 0,
      high: Math.max(duration, 0.01),
      step: 0.01,
      value: 0,
      show: (time) => `${time.toFixed(2)} s`,
      onInput: (time) => {
        if (!player) return;
        pause.set(true);
        player.paused = true;
        player.time = Math.min(time, duration);
      },
    });
    const pause = toggle("Pause", false, (on) => {
      if (player) player.paused = on;
    });
    const slow = toggle("Slow motion", false, (on) => {
      if (player) player.speed = on ? 0.25 : 1;
    });
    if (player) player.onTime = (time) => scrub.set(time);
    this.#keyboard = new Keyboard((action) => {
      if (action === "pause") pause.click();
    });
    const warnings = el("ul", { class: "list" });
    for (const warning of problems) warnings.append(el("li", {}, warning));
    const save = (): void => download(`${name || "clip"}.motion`, clip.bytes());
    return el(
      "div",
      { class: "stack" },
      el("h3", {}, file),
      el("p", {}, `${duration.toFixed(2)} s, ${frames} frames${loop ? ", a cycle" : ""}`),
      el("div", { class: "row" }, pause, slow, button("Download .motion", save), button("Follow it", () => void this.#follow(clip.bytes()), { title: "A policy follows the clip in the simulation" })),
      scrub,
      problems.length > 0 && el("h3", {}, problems.length === 1 ? "One warning" : `${problems.length} warnings`),
      problems.length > 0 && warnings,
    );
  }

  /** The character follows the clip by its own strength. */
  async #follow(clip: Uint8Array): Promise<void> {
    const { panel, stay, fail, stage } = this.#context;
    try {
      const bytes = await policy(FOLLOWER.policy);
      stay();
      this.dispose();
      stage.clear();
      this.#player = this.#pointer = this.#keyboard = null;
      this.#follower = new Player(this.#context, { agent: FOLLOWER.agent, env: { policy: bytes, clip }, distance: 4.6, skin: CHARACTER });
      panel.replaceChildren(el("h2", {}, "Motion"), el("p", {}, "A policy follows the clip. Pull it, push it, throw balls."), this.#follower.controls);
      this.#fill();
    } catch (error) {
      fail(error instanceof MarathonError ? new Error(`no policy can follow this clip: ${error.message}`) : error);
    }
  }

  #fill(): void {
    const { panel, open, openFiles, fail } = this.#context;
    panel.append(
      el("h3", {}, "Open a recording"),
      el("p", {}, "Drop a BVH, glTF or .motion file anywhere on the page."),
      el(
        "div",
        { class: "row" },
        fileButton("Open a recording", ".bvh,.glb,.gltf,.vrm,.motion,.bin", true, (files) => void files.then(openFiles, fail)),
        ...CLIPS.map((name) => button(name, () => open("motion", { motion: name }))),
      ),
    );
  }
}

export function makeMotion(context: Context): Promise<View> {
  return shown(new Motion(context));
}
