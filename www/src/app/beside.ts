/** The views beside the map. Those that were opened stay, and all but one are hidden. */
import { html, nothing, type TemplateResult } from 'lit';
import type { Handover } from './handover.js';
import type { View } from '../components/tools.js';

interface Shown {
  isDark: boolean;
  /** Whether the page's address is the element's own. */
  ownsAddress: boolean;
  /** The attribute `src`, where it is for this view. */
  sourceOf(view: 'bev' | 'icp' | 'localize'): string;
  /** Addresses of the map to locate in and of a robot's bridge, and the scene that the lab begins with. */
  host: { map: string; live: string; scene: string };
  /** Whether the bird's-eye view begins without the sample. */
  isBevEmpty: boolean;
}

export function viewsBeside(
  { shown, opened }: { shown: View; opened: ReadonlySet<View> },
  { evaluated, compared, lookedInto, toLocate, dropped }: Handover,
  { isDark, ownsAddress, sourceOf, host, isBevEmpty }: Shown,
): TemplateResult {
  const drawn = (view: View, template: (isHidden: boolean) => TemplateResult): TemplateResult | typeof nothing =>
    opened.has(view) ? template(shown !== view) : nothing;
  return html`${drawn(
    'evaluation',
    (isHidden) =>
      html`<scanstitch-evaluate ?hidden=${isHidden} ?dark=${isDark} .given=${evaluated}></scanstitch-evaluate>`,
  )}
  ${drawn(
    'strategies',
    (isHidden) =>
      html`<scanstitch-strategies ?hidden=${isHidden} ?dark=${isDark} .given=${compared}></scanstitch-strategies>`,
  )}
  ${drawn(
    'localize',
    (isHidden) =>
      html`<scanstitch-localize
        ?hidden=${isHidden}
        ?dark=${isDark}
        .given=${toLocate}
        .dropped=${dropped}
        map=${host.map}
        src=${sourceOf('localize')}
        ?linked=${ownsAddress}
      ></scanstitch-localize>`,
  )}
  ${drawn(
    'live',
    (isHidden) =>
      html`<scanstitch-live
        ?hidden=${isHidden}
        ?dark=${isDark}
        address=${host.live}
        ?linked=${ownsAddress}
      ></scanstitch-live>`,
  )}
  ${drawn(
    'icp',
    (isHidden) =>
      html`<scanstitch-lab
        ?hidden=${isHidden}
        ?dark=${isDark}
        .given=${lookedInto}
        src=${sourceOf('icp')}
        example=${host.scene}
        ?remember-link=${ownsAddress && !isHidden}
      ></scanstitch-lab>`,
  )}
  ${drawn(
    'bev',
    (isHidden) =>
      html`<scanstitch-bev
        ?hidden=${isHidden}
        ?dark=${isDark}
        src=${sourceOf('bev')}
        ?without-sample=${isBevEmpty}
        ?remember-scene=${ownsAddress}
      ></scanstitch-bev>`,
  )}`;
}
