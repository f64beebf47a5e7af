// Runs a program for wasm32-wasip1, such as a Rust test: node wasi.mjs PROGRAM [ARGUMENT ...]
//
// The program sees the files of this computer. As it cannot start Python, it leaves a question in a folder, and a second thread of this
// script runs Python and leaves the answer there (crates/physics/tests/common/oracle.rs).
import { execFile } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, renameSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { WASI } from 'node:wasi';
import { Worker, isMainThread, workerData } from 'node:worker_threads';

if (isMainThread) {
  const mail = mkdtempSync(join(tmpdir(), 'marathon-mail-'));
  const clerk = new Worker(import.meta.filename, { workerData: mail });
  const [program] = process.argv.slice(2);
  const wasi = new WASI({
    version: 'preview1',
    args: process.argv.slice(2),
    env: { ...process.env, MARATHON_ORACLE_MAIL: mail },
    preopens: { '/': '/' },
    returnOnExit: true,
  });
  const module = await WebAssembly.compile(readFileSync(program));
  // called directly from WebAssembly, these functions of Node 20 corrupt its memory
  const wrapped = (call) => (...numbers) => call(...numbers);
  const calls = Object.entries(wasi.wasiImport).map(([name, call]) => [name, wrapped(call)]);
  const instance = await WebAssembly.instantiate(module, { wasi_snapshot_preview1: Object.fromEntries(calls) });
  process.exitCode = wasi.start(instance);
  await clerk.terminate();
  rmSync(mail, { recursive: true });
} else {
  const question = join(workerData, 'question');
  const python = process.env.MARATHON_PYTHON ?? join(import.meta.dirname, '../../.venv/bin/python');
  setInterval(() => {
    if (!existsSync(question)) return;
    const { arguments: words, input } = JSON.parse(readFileSync(question, 'utf8'));
    rmSync(question);
    const child = execFile(python, words, { cwd: tmpdir(), maxBuffer: 2 ** 30 }, (error, output) => {
      writeFileSync(join(workerData, 'answer.part'), error ? String(error) : `ok\n${output}`);
      renameSync(join(workerData, 'answer.part'), join(workerData, 'answer'));
    });
    child.stdin.on('error', () => {}); // a script that fails at once closes it
    child.stdin.end(input);
  }, 5);
}
