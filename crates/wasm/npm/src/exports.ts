/** The functions of the module. Numbers below 0 are errors; the message is in the output buffer. */
export interface Exports {
  readonly memory: WebAssembly.Memory;
  start(): void;
  fuses(): number;
  panicked(): void;
  input(length: number): number;
  output(): number;
  output_length(): number;
  free_object(object: number): void;
  agents(): number;
  policy_info(): number;
  env_new(): number;
  env_reset(env: number): number;
  env_reset_agent(env: number, agent: number): number;
  env_step(env: number, byPolicy: number): number;
  env_array(env: number, which: number): number;
  env_set_policy(env: number): number;
  env_command(env: number, agent: number): number;
  env_push(env: number, agent: number, body: number, ...forceAndTorque: number[]): number;
  env_state(env: number, agent: number): number;
  env_set_state(env: number, agent: number): number;
  env_ground(env: number, agent: number, field: number): number;
  env_set_ground(env: number, agent: number, field: number): number;
  env_save(env: number): number;
  env_load(env: number): number;
  env_hash(env: number): number;
  simulation_new(): number;
  simulation_reset(simulation: number): number;
  simulation_step(simulation: number, steps: number): number;
  simulation_array(simulation: number, which: number): number;
  simulation_push(simulation: number, body: number, ...forceAndTorque: number[]): number;
  simulation_state(simulation: number): number;
  simulation_set_state(simulation: number): number;
  simulation_ground(simulation: number, field: number): number;
  simulation_mesh(simulation: number, mesh: number): number;
  simulation_hash(simulation: number): number;
  training_new(): number;
  training_iterate(training: number): number;
  training_policy(training: number): number;
  clip_new(): number;
  clip_array(clip: number, which: number, time: number): number;
  clip_bytes(clip: number): number;
}

/** Arrays of an object in the module's memory. */
export const ARRAY = {
  actions: 0,
  obs: 1,
  reward: 2,
  terminated: 3,
  truncated: 4,
  info: 5,
  geoms: 6,
  bodies: 7,
} as const;

/** Numbers of a matrix. */
export const MATRIX = 16;
