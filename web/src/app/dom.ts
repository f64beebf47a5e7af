/** Elements of the page, made in one call. */

type Child = Node | string | null | undefined | false;
type Props = Readonly<Record<string, string | number | boolean | EventListener | undefined>>;

/** Makes an element. A property that is a function listens to the event of its name; others are attributes. */
export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name, value);
    else if (name === "value") (element as unknown as { value: string }).value = String(value);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((child): child is Node | string => child !== null && child !== undefined && child !== false));
  return element;
}

export function button(label: string, onClick: () => void, props: Props = {}): HTMLButtonElement {
  return el("button", { type: "button", click: onClick, ...props }, label);
}

/** A button that is on or off. */
export function toggle(label: string, on: boolean, onChange: (on: boolean) => void): HTMLButtonElement & { set(on: boolean): void } {
  const made = button(label, () => {
    made.set(!on);
    onChange(on);
  }) as HTMLButtonElement & { set(on: boolean): void };
  made.set = (now) => {
    on = now;
    made.setAttribute("aria-pressed", String(on));
  };
  made.set(on);
  return made;
}

export interface Choice {
  readonly value: string;
  readonly label: string;
}

/** A labelled list to choose from. */
export function select(label: string, choices: readonly Choice[], value: string, onChange: (value: string) => void): HTMLLabelElement {
  const list = el("select", { change: () => onChange(list.value) });
  for (const choice of choices) list.append(el("option", { value: choice.value }, choice.label));
  list.value = value;
  return el("label", { class: "field" }, el("span", {}, label), list);
}

export interface Slider {
  readonly label: string;
  readonly low: number;
  readonly high: number;
  readonly value: number;
  readonly step?: number;
  readonly show?: (value: number) => string;
  readonly onInput: (value: number) => void;
}

export function slider({ label, low, high, value, step, show, onInput }: Slider): HTMLLabelElement & { set(value: number): void } {
  const text = show ?? ((x: number) => x.toFixed(2));
  const output = el("span", { class: "value" }, text(value));
  const input = el("input", {
    type: "range",
    "aria-label": label,
    min: low,
    max: high,
    step: step ?? (high - low) / 200,
    value,
    input: () => {
      setText(input.valueAsNumber);
      onInput(input.valueAsNumber);
    },
  });
  const setText = (now: number): void => {
    output.textContent = text(now);
    input.setAttribute("aria-valuetext", text(now));
  };
  setText(value);
  const made = el("label", { class: "slider" }, el("span", {}, label), output, input) as HTMLLabelElement & {
    set(value: number): void;
  };
  made.set = (now) => {
    input.value = String(now);
    setText(now);
  };
  return made;
}

/** Offers bytes as a file to save. */
export function download(name: string, bytes: Uint8Array | Blob, type = "application/octet-stream"): void {
  const blob = bytes instanceof Blob ? bytes : new Blob([bytes as Uint8Array<ArrayBuffer>], { type });
  const url = URL.createObjectURL(blob);
  const link = el("a", { href: url, download: name });
  link.click();
  // the browser has read the link by then
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
