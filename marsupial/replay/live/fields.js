/* Fields of a form, each with its label and the problem that the service has with it. */

import { make } from "#draw/dom.js";

/** @typedef {HTMLInputElement | HTMLSelectElement} FieldInput */

export class Fields {
  constructor() {
    /** @type {Map<string, { input: FieldInput, problem: HTMLElement }>} */
    this.byName = new Map();
  }

  /** @type {(name: string, label: string, options: [value: string, text: string][], chosen: string) => HTMLElement} */
  select(name, label, options, chosen) {
    const input = make("select", {}, ...options.map(([value, text]) => make("option", { value, text })));
    input.value = chosen;
    return this.add(name, label, input);
  }

  /** @type {(name: string, label: string, value: number, min: number, step?: number) => HTMLElement} */
  number(name, label, value, min, step = 1) {
    return this.add(name, label, make("input", { type: "number", value, min, step, required: true }));
  }

  /** @type {(name: string, label: string, accept: string) => HTMLElement} */
  file(name, label, accept) {
    return this.add(name, label, make("input", { type: "file", accept }));
  }

  /** @type {(name: string, label: string, input: FieldInput) => HTMLElement} */
  add(name, label, input) {
    const id = `start-${name}`;
    const problem = make("span", { class: "problem", id: `${id}-problem`, role: "alert" });
    input.id = id;
    input.name = name;
    input.setAttribute("aria-describedby", problem.id);
    input.addEventListener("input", () => this.showProblem(name, ""));
    this.byName.set(name, { input, problem });
    return make("label", { for: id }, make("span", { text: label }), input, problem);
  }

  /** The input of a field that was added.
      @type {(name: string) => FieldInput} */
  input(name) {
    return this.field(name).input;
  }

  /** @type {(name: string) => { input: FieldInput, problem: HTMLElement }} */
  field(name) {
    const field = this.byName.get(name);
    if (!field) throw new Error(`the form has no field ${name}`);
    return field;
  }

  /** @type {(name: string) => string} */
  value(name) {
    return this.input(name).value;
  }

  /** The number in a field; null if it is empty.
      @type {(name: string) => number | null} */
  numberIn(name) {
    return this.value(name) === "" ? null : Number(this.value(name));
  }

  /** The file of a field, or undefined.
      @type {(name: string) => File | undefined} */
  fileIn(name) {
    const input = this.input(name);
    return input instanceof HTMLInputElement ? input.files?.[0] : undefined;
  }

  /** @type {(name: string, file: File) => void} */
  setFile(name, file) {
    const given = new DataTransfer();
    given.items.add(file);
    const input = this.input(name);
    if (input instanceof HTMLInputElement) input.files = given.files;
  }

  /** Show what is wrong with a field; an empty text: nothing. Returns where it stands.
      @type {(name: string, text: string) => HTMLElement} */
  showProblem(name, text) {
    const { input, problem } = this.field(name);
    problem.textContent = text;
    input.toggleAttribute("aria-invalid", text !== "");
    return problem;
  }
}

/** The bytes of a file in base 64.
    @type {(file: File) => Promise<string>} */
export async function base64(file) {
  /** @type {string} */
  const address = await new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(String(reader.result));
    reader.onerror = () => reject(reader.error);
    reader.readAsDataURL(file);
  });
  return address.slice(address.indexOf(",") + 1);
}
