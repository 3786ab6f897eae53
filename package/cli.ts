#!/usr/bin/env node
/** The `scanstitch` command as a process. */
import { fileProblem } from './cli/disk.js';
import { main } from './cli/main.js';
import { exitCodeOfFailure, tell } from './cli/terminal.js';

// `scanstitch ... | head` closes the pipe early, which is no failure.
process.stdout.on('error', (error) => {
  if ((error as NodeJS.ErrnoException).code === 'EPIPE') return;
  process.exitCode = exitCodeOfFailure();
  tell(`scanstitch: The output could not be printed. ${fileProblem(error)}`);
});
// Nobody reads stderr: the exit code still says what happened.
process.stderr.on('error', () => {});

const code = await main(process.argv.slice(2));
process.exitCode ??= code;
