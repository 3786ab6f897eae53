/** The topics of a bag, and what each is used as. */
import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import type { Role } from '../../../package/bag/roles.js';
import { type Choice, ROLES, SOURCES, type TopicFacts, type Wishes } from '../../../package/bag/topics.js';
import type { ListedBag } from '../../../package/recording_reader.js';
import { type Choices, list } from '../components/list-field.js';
import { shared, wrap } from '../components/theme.js';
import { formatCount, plural } from '../views/format.js';
import { fire } from '../components/fire.js';

export type { Wishes };

export interface BagState {
  /** Null before its topics are known. */
  listed: ListedBag | null;
  /** Null before the messages have been looked into. */
  choice: Choice | null;
  /** What somebody has chosen. */
  wishes: Wishes;
  /** What is being done with the bag; empty when it is open. */
  activity: string;
}

const WORDS: Readonly<Record<Role, string>> = {
  depth: 'depth images',
  color: 'colours',
  camera: 'depth camera',
  clouds: 'clouds',
  scans: 'laser scans',
  imu: 'inertial unit',
  odometry: 'odometry',
  reference: 'ground truth',
};

/**
 * One line that says what is used of a bag; unfolded, all its topics, with what each may be used as.
 *
 * Fires `topics-chosen`, whose `detail` holds the wishes, and `topics-cancelled`, where a bag is not to be opened after all.
 */
@customElement('scanstitch-topics')
export class ScanstitchTopics extends LitElement {
  @property({ attribute: false }) bag!: BagState;
  @state() private isOpen = false;

  protected override render(): TemplateResult {
    const { listed, activity } = this.bag;
    return html`<section aria-label="Topics of the bag">
      ${listed ? this.renderUnfold(listed) : nothing}
      <p class="summary">${activity === '' ? this.renderUsed() : html`<span role="status">${activity} …</span>`}</p>
      ${activity === '' ? nothing : html`<button class="quiet" @click=${this.cancel}>Cancel</button>`}
      <div id="list" class="list" role="group" aria-label="List of topics" ?hidden=${!this.isOpen} tabindex="0">
        ${this.isOpen && listed ? this.renderTable(listed) : nothing}
      </div>
    </section>`;
  }

  private renderUnfold({ topics }: ListedBag): TemplateResult {
    return html`<button
      class="quiet"
      aria-expanded=${this.isOpen}
      aria-controls="list"
      @click=${() => {
        this.isOpen = !this.isOpen;
      }}
    >
      <svg width="10" height="10" viewBox="0 0 10 10" aria-hidden="true">
        <path d=${this.isOpen ? 'M1 3l4 4 4-4' : 'M3 1l4 4-4 4'} fill="none" stroke="currentColor" stroke-width="1.6" />
      </svg>
      ${plural(topics.length, 'topic')}
    </button>`;
  }

  private cancel(): void {
    fire(this, 'topics-cancelled');
  }

  /** What is used, in a line. */
  private renderUsed(): TemplateResult {
    const { choice } = this.bag;
    const used = ROLES.filter((role) => choice?.[role] !== undefined && role !== 'camera');
    if (used.length === 0) return html`<span class="muted">No topic of this bag can be used.</span>`;
    return html`${used.map((role) => html`<span class="used"><span class="muted">${WORDS[role]}</span> ${choice?.[role]}</span>`)}`;
  }

  private renderTable({ topics }: ListedBag): TemplateResult {
    return html`<table>
      <thead>
        <tr>
          <th scope="col">Topic</th>
          <th scope="col">Type</th>
          <th scope="col" class="number">Messages</th>
          <th scope="col" class="number">Per second</th>
          <th scope="col">Used as</th>
        </tr>
      </thead>
      <tbody>
        ${topics.map((facts) => this.renderTopic(facts))}
      </tbody>
    </table>`;
  }

  private renderTopic(facts: TopicFacts): TemplateResult {
    const { topic, about, problem, uses } = facts;
    const [owner = '', name = topic.type] = topic.type.split('/msg/');
    return html`<tr>
      <th scope="row">
        ${topic.name}<small>${problem ? `${problem[0]?.toUpperCase()}${problem.slice(1)}` : about}</small>
      </th>
      <td><span class="muted package">${owner}/</span>${name}</td>
      <td class="number">${formatCount(topic.count)}</td>
      <td class="number">${topic.rate === null ? '' : topic.rate.toFixed(1)}</td>
      <td>${uses.length > 0 ? this.renderSelect(facts) : html`<span class="muted">nothing</span>`}</td>
    </tr>`;
  }

  private renderSelect({ topic, uses }: TopicFacts): TemplateResult {
    const { choice } = this.bag;
    const role = ROLES.find((candidate) => choice?.[candidate] === topic.name);
    const choices: Choices<Role | ''> = [['', 'nothing'], ...uses.map((use) => [use, WORDS[use]] as const)];
    return list(choices, role ?? '', (use) => this.choose(topic.name, use), {
      label: `Use ${topic.name} as`,
      isOff: choice === null,
    });
  }

  private choose(topic: string, role: Role | ''): void {
    const { choice, wishes } = this.bag;
    const before = ROLES.find((candidate) => choice?.[candidate] === topic);
    const next: Wishes = { ...wishes };
    if (before) next[before] = null;
    if (role !== '') {
      // A map is made from one kind of message; the topics that belong to it are determined again.
      if (SOURCES.includes(role)) for (const other of ROLES) delete next[other];
      next[role] = topic;
    }
    fire(this, 'topics-chosen', next);
  }

  static override styles = [
    shared,
    css`
      :host {
        flex: none;
        border-bottom: 1px solid var(--line);
        background: var(--surface);
        font-size: calc(12.5 * var(--px));
      }
      section {
        ${wrap};
        gap: 2px 10px;
        padding: 3px 12px 3px 8px;
      }
      .summary {
        display: flex;
        flex: 1;
        flex-wrap: wrap;
        gap: 0 18px;
        min-width: 0;
        overflow-wrap: anywhere;
      }
      .list {
        flex-basis: 100%;
        max-height: min(38vh, 272px);
        overflow: auto;
      }
      table {
        width: 100%;
        border-collapse: collapse;
      }
      th,
      td {
        padding: 5px 10px;
        border-top: 1px solid var(--line);
        font-weight: 400;
        text-align: left;
        vertical-align: middle;
      }
      thead th {
        border-top: 0;
        color: var(--muted);
        font-weight: 600;
        white-space: nowrap;
      }
      tbody th {
        font-weight: 550;
        overflow-wrap: anywhere;
      }
      th.number,
      td.number {
        text-align: right;
        white-space: nowrap;
      }
      small {
        display: block;
        color: var(--muted);
        font-size: calc(11.5 * var(--px));
        font-weight: 400;
      }
      select {
        min-height: 28px;
        max-width: 100%;
      }
      @media (pointer: coarse) {
        select {
          min-height: 40px;
        }
      }
      @media (max-width: 620px) {
        thead {
          position: absolute;
          clip-path: inset(50%);
        }
        tr {
          ${wrap};
          gap: 2px 8px;
          padding: 8px 0;
          border-top: 1px solid var(--line);
        }
        th,
        td {
          padding: 0 4px;
          border: 0;
        }
        tbody th,
        td:last-child {
          flex-basis: 100%;
        }
        td:nth-child(3)::after {
          content: ' messages';
          color: var(--muted);
        }
        td:nth-child(4):not(:empty)::after {
          content: ' a second';
          color: var(--muted);
        }
      }
    `,
  ];
}
