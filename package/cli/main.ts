/**
 * The `scanstitch` command. Each subcommand is a module of this folder with a name, a line about it, its help and what it
 * does; this file only chooses.
 */
import { lookUp } from '../base/look_up.js';
import { type Command, CommandError, EXIT, isScanstitchError } from './command.js';
import { exitCodeOfFailure, print, tell } from './terminal.js';

/**
 * Where each command is. One that is not asked for is not loaded: reading all of them takes as long as a dozen scans.
 */
const COMMANDS: Record<string, () => Promise<Command>> = {
  reconstruct: async () => (await import('./reconstruct.js')).reconstruct,
  edit: async () => (await import('./edit.js')).edit,
  localize: async () => (await import('./localize.js')).localize,
  export: async () => (await import('./export.js')).exportMap,
  evaluate: async () => (await import('./evaluate.js')).evaluate,
  convert: async () => (await import('./convert.js')).convert,
  'map-quality': async () => (await import('./map_quality.js')).mapQuality,
  consistency: async () => (await import('./consistency.js')).consistency,
  strategies: async () => (await import('./strategies.js')).strategies,
  live: async () => (await import('./live.js')).live,
  optimize: async () => (await import('./optimize.js')).optimize,
  bev: async () => (await import('./bev.js')).bev,
  icp: async () => (await import('./icp.js')).icp,
  topics: async () => (await import('./topics.js')).topics,
  settings: async () => (await import('./settings.js')).settings,
};

const INTRODUCTION = `Laser scans, depth images and clouds to a trajectory and a stitched map; errors of trajectories against a reference.

Usage: scanstitch COMMAND [ARGUMENT]...
       scanstitch COMMAND --help
       scanstitch --help | --version
`;
const EXIT_CODES = `Exit codes:
  0  everything asked for was done
  1  nothing was computed: the command is wrong, or no input can be used
  2  the results were written, but something was left out: a file that could not be used, or a scan that could not be
     placed. The lines on stderr name it.
`;

async function fullHelp(engine: typeof import('../index.js')) {
  const commands = await Promise.all(Object.values(COMMANDS).map((load) => load()));
  const list = commands.map(({ name, about }) => `  ${name.padEnd(14)} ${about}\n`).join('');
  const each = commands.map((command) => `\n${command.help(engine)}`).join('');
  return `${INTRODUCTION}\nCommands:\n${list}\n${EXIT_CODES}${each}`;
}

/** The engine, ready; or, in a clone that has not been built, what to do. */
async function loadEngine() {
  let engine;
  try {
    engine = await import('../index.js');
  } catch (error) {
    if ((error as NodeJS.ErrnoException).code !== 'ERR_MODULE_NOT_FOUND') throw error;
    throw new CommandError('The engine has not been built yet. In the clone, run: npm run build');
  }
  await engine.load();
  return engine;
}

async function run([name, ...args]: string[]) {
  const engine = await loadEngine();
  if (name === '--version') {
    print(`${engine.version()}\n`);
    return EXIT.done;
  }
  if (name === '--help' || name === '-h' || name === 'help') {
    print(await fullHelp(engine));
    return EXIT.done;
  }
  const load = name === undefined ? undefined : lookUp(COMMANDS, name);
  if (!load) {
    const problem = name === undefined ? 'No command was given' : `There is no command ${JSON.stringify(name)}`;
    const known = Object.keys(COMMANDS).join(', ');
    throw new CommandError(`${problem}. There are: ${known}. For all about them: scanstitch --help`);
  }
  const command = await load();
  if (args.includes('--help') || args.includes('-h')) {
    print(command.help(engine));
    return EXIT.done;
  }
  return command.run(engine, args);
}

/** Runs the command line; returns the exit code. */
export async function main(args: string[]) {
  try {
    return await run(args);
  } catch (error) {
    if (error instanceof CommandError || isScanstitchError(error)) tell(`scanstitch: ${error.message}`);
    else {
      tell('scanstitch: This is a defect of Scanstitch, not of your files. Please report it with these lines.');
      for (const line of String((error as Error).stack).split('\n')) tell(line);
    }
    return exitCodeOfFailure();
  }
}
