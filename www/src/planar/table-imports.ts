/**
 * Tables of ranges among the files that are opened: what their columns are is guessed, or taken from the page's address, and
 * asked for where neither tells.
 */
import { latin1 } from '../../../package/files/heads.js';
import type { Dataset } from '../datasets/dataset.js';
import type { InputFile, TableFacts } from '../engine/protocol.js';
import type { Address } from '../views/address.js';
import type { TableRequest } from './table-import.js';
import type { Intake } from '../datasets/take-in.js';
import { rememberTable, tableOfLink } from './table-format.js';

/** Names of trajectories, which are no tables of ranges. */
const TRAJECTORY_NAME = /traj|pose|position|odom|path|truth|gt|ref|tum|wheel/i;
/** A table of so many columns may be readings, a line each; others are mostly poses. */
const READING_COLUMNS = [2, 3, 4, 5, 6];

export interface TableHooks {
  /** Whether the page's address is the page's own, to read formats from and to write them into. */
  address(): Address | null;
  /** Null where a file is no table, or there is no engine to tell. */
  describe(file: InputFile, format: string | null, scan: number): Promise<TableFacts | null>;
  /** Reads the tables that are loaded once more. */
  reload(format: string): void;
  changed(): void;
}

export class TableImports {
  /** What somebody is being asked; null where nothing. */
  request: TableRequest | null = null;
  readonly #hooks: TableHooks;
  /** Formats of tables that nobody had to be asked about, by their names. */
  readonly #guessed = new Map<string, string>();
  #answer: (format: string | null) => void = () => undefined;

  constructor(hooks: TableHooks) {
    this.#hooks = hooks;
  }

  isTable({ name, table }: InputFile): boolean {
    return table !== undefined || this.#guessed.has(name);
  }

  /** The table that is loaded, and how it is read; null without. */
  shown(dataset: Dataset | null): { file: InputFile; format: string } | null {
    const file = dataset?.scans.find((scan) => this.isTable(scan));
    return file ? { file, format: file.table ?? this.#guessed.get(file.name) ?? '' } : null;
  }

  /**
   * Finds out what the columns of the tables are that were taken in, and then loads them: at once, or when somebody has
   * answered. `mayBeScans`: whether a trajectory alone has nothing here that it belongs to.
   */
  async ask(intake: Intake, mayBeScans: boolean, load: (intake: Intake) => void): Promise<void> {
    const tables = intake.scans.filter(({ isTable }) => isTable);
    const alone = mayBeScans && intake.scans.length === 0 ? intake.reference : null;
    const file = tables[0] ?? alone;
    if (!file) return load(intake);
    const linked = tableOfLink(this.#hooks.address()?.fragment ?? '');
    const facts = await this.#hooks.describe(file, linked || null, 0).catch(() => null);
    if (!facts) return load(intake);
    const asFormat = (format: string): Intake => withFormat(intake, file === alone ? [file] : tables, format);
    const isClear = facts.problem === '' && facts.doubt === '';
    if (file === alone) {
      const isPath = TRAJECTORY_NAME.test(file.name) || isOfPositions(file);
      const mayBeReadings = READING_COLUMNS.includes(facts.num_columns) && !isPath;
      if (!mayBeReadings) return load(intake);
    } else if (isClear) {
      for (const { name } of tables) this.#guessed.set(name, facts.format);
      return load(linked === '' ? intake : asFormat(linked));
    }
    this.#open(file, facts, (format) => {
      // Cancelled, tables are left where they are; a trajectory is told of.
      if (format !== null) load(asFormat(format));
      else if (file === alone) load(intake);
    });
  }

  /** Asks anew about the table that is loaded. */
  async change(dataset: Dataset | null): Promise<void> {
    const shown = this.shown(dataset);
    const facts = shown && (await this.#hooks.describe(shown.file, shown.format, 0).catch(() => null));
    if (!facts) return;
    this.#open(shown.file, facts, (format) => {
      if (format !== null) this.#hooks.reload(format);
    });
  }

  /** The answer of whoever was asked; null: cancelled. */
  answer(format: string | null): void {
    this.request = null;
    this.#hooks.changed();
    const address = this.#hooks.address();
    if (format !== null && address) rememberTable(address, format);
    this.#answer(format);
  }

  #open(file: InputFile, facts: TableFacts, answer: (format: string | null) => void): void {
    const describe = async (format: string, scan: number): Promise<TableFacts> => {
      const described = await this.#hooks.describe(file, format, scan);
      if (!described) throw new Error('The file is no longer a table');
      return described;
    };
    this.#answer = answer;
    this.request = { name: file.name, facts, describe };
    this.#hooks.changed();
  }
}

/** So much of a table is looked at (bytes). */
const LOOKED_AT = 2 ** 16;
const NAME_OF_X = /^(?:[a-z]*[._])?(?:x|easting)(?:[_([].*)?$/i;
const NAME_OF_Y = /^(?:[a-z]*[._])?(?:y|northing)(?:[_([].*)?$/i;

/** Whether columns are named x and y, or numbers behind the first column are negative, as no range is. */
function isOfPositions({ bytes }: InputFile): boolean {
  const text = latin1(new Uint8Array(bytes, 0, Math.min(bytes.byteLength, LOOKED_AT)));
  const rows = text.split(/[\r\n]+/).map((line) => line.split(/[\s,;|"#%]+/).filter((word) => word !== ''));
  const areNamed = rows
    .slice(0, 3)
    .some((row) => row.some((word) => NAME_OF_X.test(word)) && row.some((word) => NAME_OF_Y.test(word)));
  // The last row may be cut off.
  return areNamed || rows.slice(0, -1).some((row) => row.slice(1).some((word) => Number(word) < 0));
}

/** These files read by a format, as scans. */
function withFormat(intake: Intake, tables: readonly InputFile[], table: string): Intake {
  const [first] = tables;
  if (first && intake.reference === first) {
    return { ...intake, scans: [{ ...first, table, isLog: true, isTable: true }], reference: null };
  }
  return { ...intake, scans: intake.scans.map((scan) => (tables.includes(scan) ? { ...scan, table } : scan)) };
}
