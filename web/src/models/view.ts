/** Models: any MJCF, from files, a link or a repository on GitHub. Hands pull it, sliders control its actuators. */
import type { Simulation } from "marathon-rl";
import { button, el, slider, toggle } from "../app/dom";
import { fileButton } from "../app/files";
import { isEmbedded } from "../app/route";
import { type Context, type View, shown } from "../app/view";
import { Keyboard } from "../input/keyboard";
import { PointerControl } from "../input/pointer";
import { addressOf } from "./paths";
import { type Sample, SAMPLES } from "./samples";
import { type Opened, openAddress, openFiles } from "./source";
import { Table } from "./table";

/** Most sliders. */
const MOST = 40;
/** Range of the slider of an actuator without one. */
const OPEN = 1;

class Models implements View {
  readonly #context: Context;
  readonly #sliders: ReturnType<typeof slider>[] = [];
  readonly #keyboard: Keyboard;
  #table: Table | null = null;
  #pointer: PointerControl | null = null;
  #pause: ReturnType<typeof toggle> | null = null;

  constructor(context: Context) {
    this.#context = context;
    this.#keyboard = new Keyboard((action) => {
      if (action === "restart") this.#reset();
      else if (action === "pause") this.#pause?.click();
      else if (action === "throw") this.#table?.puppet.throwBall();
    });
    context.stage.canvas.setAttribute("aria-label", "Picture of the model. Drag a body to pull it; X resets, Enter pauses, B throws a ball.");
  }

  async show(): Promise<void> {
    const { panel, stay } = this.#context;
    panel.replaceChildren(el("h2", {}, "Models"));
    const { simulation, name } = await this.#find();
    try {
      stay();
    } catch (error) {
      simulation.free();
      throw error;
    }
    this.#lay(simulation);
    panel.append(el("h3", {}, name), this.#facts(simulation), this.#controls(simulation));
    this.#fill();
  }

  dispose(): void {
    this.#keyboard.dispose();
    this.#pointer?.dispose();
    this.#table?.dispose();
  }

  async #find(): Promise<Opened> {
    const { marathon, files, params, link } = this.#context;
    if (files.length > 0) return openFiles(marathon, files);
    const model = params.get("model") ?? SAMPLES[0]?.name ?? "";
    const sample = SAMPLES.find(({ name }) => name === model);
    if (sample) return { simulation: marathon.simulation(sample.xml, {}, `${sample.name}.xml`), name: sample.label };
    link({ model });
    return openAddress(marathon, addressOf(model, document.baseURI));
  }

  #lay(simulation: Simulation): void {
    const { stage } = this.#context;
    const table = new Table(stage, simulation, (error) => this.#context.fail(error));
    this.#table = table;
    this.#pointer = new PointerControl(stage, table.puppet);
    stage.show(table);
  }

  #reset(): void {
    this.#table?.reset();
    for (const [i, control] of this.#sliders.entries()) control.set(this.#table?.controls[i] ?? 0);
  }

  #facts({ model }: Simulation): HTMLElement {
    const boxes = model.geoms.filter(({ kind, mesh, group }) => kind === "mesh" && mesh === null && group < 3).length;
    return el(
      "div",
      {},
      el("p", {}, `${[count(model.bodies.length - 1, "body", "bodies"), count(model.nv, "degree of freedom", "degrees of freedom"), count(model.actuators.length, "actuator")].join(", ")}, ${(1000 * model.timestep).toFixed(1)} ms a step`),
      boxes > 0 && el("p", { class: "notice" }, "Meshes without files are not shown."),
    );
  }

  #controls({ model }: Simulation): HTMLElement {
    const table = this.#table;
    const sliders = el("div", { class: "sliders" });
    for (const [i, { name, low, high }] of model.actuators.slice(0, MOST).entries()) {
      const bounded = Number.isFinite(low) && Number.isFinite(high) && low < high;
      const control = slider({
        label: name || `actuator ${i}`,
        low: bounded ? low : -OPEN,
        high: bounded ? high : OPEN,
        value: table?.controls[i] ?? 0,
        onInput: (value) => {
          if (table) table.controls[i] = value;
        },
      });
      this.#sliders.push(control);
      sliders.append(control);
    }
    this.#pause = toggle("Pause", false, (on) => {
      if (table) table.clock.paused = on;
    });
    const slow = toggle("Slow motion", false, (on) => {
      if (table) table.clock.speed = on ? 0.2 : 1;
    });
    return el(
      "div",
      { class: "stack" },
      el("div", { class: "row" }, button("Reset", () => this.#reset()), this.#pause, slow, button("Throw a ball", () => table?.puppet.throwBall())),
      model.actuators.length > 0 && el("h3", {}, "Controls"),
      sliders,
      model.actuators.length > MOST && el("p", {}, `The first ${MOST} of ${model.actuators.length} actuators.`),
    );
  }

  #fill(): void {
    const { panel, open, openFiles: give, fail } = this.#context;
    if (isEmbedded(new URL(location.href))) return;
    const address = el("input", { type: "text", placeholder: "github:owner/repo/path.xml", "aria-label": "Address of a model", spellcheck: "false" });
    const form = el("form", {
      class: "row address",
      submit: (event) => {
        event.preventDefault();
        if (address.value.trim() !== "") open("models", { model: address.value.trim() });
      },
    }, address, el("button", { type: "submit" }, "Open"));
    const samples = SAMPLES.map(({ name, label }: Sample) => button(label, () => open("models", { model: name })));
    panel.append(
      el("h3", {}, "Open a model"),
      el("p", {}, "Drop an MJCF file, or its folder, anywhere on the page."),
      el("div", { class: "row" }, fileButton("Open files", ".xml,.mjcf,.obj,.stl,.png,.bin,.msh", true, (files) => void files.then(give, fail)), ...samples),
      form,
    );
  }
}

function count(number: number, one: string, more = `${one}s`): string {
  return `${number} ${number === 1 ? one : more}`;
}

export function makeModels(context: Context): Promise<View> {
  return shown(new Models(context));
}
