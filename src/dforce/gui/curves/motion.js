// The motion at one point: the tip above the sample, to scale, and its traces, which move together.
const PERIOD = 3; // s on the screen for a period of the motion
const TALL = 46; // the tip on the screen; only its apex is to scale
const round = (x) => {
  const power = 10 ** Math.floor(Math.log10(x));
  return [1, 2, 5].map((n) => n * power).findLast((n) => n <= x) ?? power;
};
const digits = (x) => (x === 0 ? "0" : Math.abs(x) >= 1000 || Math.abs(x) < 0.001 ? x.toExponential(1) : String(Number(x.toPrecision(3))));

export default {
  template: `
    <section class="df-motion" aria-label="motion at a point" :data-state="state" :class="{'df-behind': behind}">
      <header class="df-motion-head df-with-key"><h2 v-if="places.length">Motion at <template v-for="(part, n) in places" :key="n"><template v-if="n">, </template>
          <span v-if="part.symbol"><span class="df-symbol" v-html="part.symbol"></span> = </span>{{ part.text }}</template></h2>
        <p v-else class="df-text">Click on a point of a curve: the motion of the tip appears here.</p>
        <p v-if="motion && !error" class="df-tick-text">Shaded: in contact. Dashed: the tip at rest. Arrow: the force on the tip, at most
          {{ digits(motion.peak) }} {{ motion.forceUnit }}. All is to scale.</p></header>
      <p v-if="error" class="df-motion-note wrong" role="alert">{{ error }}</p>
      <p v-else-if="note" class="df-motion-note" role="status">{{ note }}</p>
      <template v-if="motion && !error">
        <svg class="df-tip" viewBox="0 0 330 196" preserveAspectRatio="xMinYMin" role="img" :aria-label="spoken">
          <g v-for="view in views" :key="view.name">
            <clipPath :id="uid + view.name"><rect :x="view.left" y="16" :width="view.width" height="164" /></clipPath>
            <text class="df-tick" :x="view.left" y="10">{{ view.title }}</text>
            <g :clip-path="'url(#' + uid + view.name + ')'">
              <rect class="df-back" :x="view.left" y="16" :width="view.width" height="164" />
              <rect class="df-sample" :x="view.left" :y="view.y(0)" :width="view.width" :height="Math.max(0, 180 - view.y(0))" />
              <line v-if="view.rest" class="df-rest" :x1="view.left" :x2="view.left + view.width" :y1="view.y(rest)" :y2="view.y(rest)" />
              <path v-if="view.rest" class="df-lever" :d="lever(view)" />
              <path class="df-tip-body" :d="tip(view)" />
            </g>
            <rect class="df-frame" :x="view.left" y="16" :width="view.width" height="164" />
            <path class="df-bar" :d="bar(view)" />
            <text class="df-tick" :x="view.left + 10 + view.bar * view.scale" y="191" dx="4">{{ view.bar }} {{ motion.length }}</text>
          </g>
          <path class="df-arrow" :class="{pull: force < 0}" :d="arrow" />
        </svg>
        <div class="df-motion-values">
          <span>time <b>{{ digits(now * motion.step) }} {{ motion.time }}</b></span>
          <span>force <b>{{ digits(force) }} {{ motion.forceUnit }}</b></span>
          <span>indentation <b>{{ digits(depth) }} {{ motion.length }}</b></span>
        </div>
        <div class="df-motion-play">
          <button type="button" class="df-plain" :aria-pressed="playing ? 'false' : 'true'" @click="playing = !playing">
            {{ playing ? 'Pause' : 'Play' }}</button>
          <input type="range" min="0" :max="count - 1" step="1" :value="now" aria-label="place in the motion"
                 :aria-valuetext="digits(now * motion.step) + ' ' + motion.time" @input="scrub($event.target.valueAsNumber)" />
          <span class="df-tick-text">{{ slower }}</span>
        </div>
        <figure v-for="trace in motion.traces" :key="trace.name" class="df-trace">
          <figcaption>{{ trace.label }} <span class="df-symbol" v-html="trace.symbol"></span> ({{ trace.unit }})</figcaption>
          <svg viewBox="0 0 330 60" role="img" :aria-label="trace.label + ' over time, from ' + digits(low(trace)) + ' to ' + digits(high(trace)) + ' ' + trace.unit">
            <rect v-for="(span, n) in contacts" :key="n" class="df-contact" :x="across(span[0])" :width="across(span[1]) - across(span[0])" y="4" height="52" />
            <text class="df-tick" x="58" y="12" text-anchor="end">{{ digits(high(trace)) }}</text>
            <text class="df-tick" x="58" y="56" text-anchor="end">{{ digits(low(trace)) }}</text>
            <line class="df-rest" x1="64" x2="328" :y1="up(trace, 0)" :y2="up(trace, 0)" v-if="low(trace) < 0 && high(trace) > 0" />
            <template v-if="trace.name === 'force'"><path v-for="(part, n) in motion.parts" :key="part.name" class="df-part" :data-part="n"
                :d="path(trace, part.values)"><title>{{ part.name }}</title></path></template>
            <path class="df-line" :d="paths[trace.name]" />
            <line class="df-cursor" :x1="across(now)" :x2="across(now)" y1="4" y2="56" />
            <circle class="df-cursor-dot" :cx="across(now)" :cy="up(trace, trace.values[now])" r="3" />
          </svg>
          <p v-if="trace.name === 'force' && motion.parts.length" class="df-tick-text"><span v-for="(part, n) in motion.parts"
              :key="part.name" class="df-part-name" :data-part="n">{{ part.name }} {{ digits(part.values[now]) }} {{ motion.forceUnit }}</span></p>
        </figure>
      </template>
    </section>`,
  props: { places: { default: () => [] }, note: { default: "" }, error: { default: "" }, motion: { default: null }, state: { default: "" },
           behind: Boolean },
  data() {
    return { now: 0, playing: true, uid: "motion-" + Math.random().toString(36).slice(2) };
  },
  computed: {
    moving() { return this.playing && this.motion !== null && !this.error && !this.behind; },
    count() { return this.motion.gap.length; },
    rest() { return this.motion.rest; },
    force() { return this.motion.force[this.now]; },
    depth() { return Math.max(0, -this.motion.gap[this.now]); },
    slower() {
      const factor = (PERIOD * this.motion.periods) / (this.count * this.motion.step * this.motion.second);
      return factor >= 10 ? "slowed " + Number(factor.toPrecision(2)).toLocaleString("en-US") + " times" : "";
    },
    spoken() {
      return "drawing of the tip above the sample, moving; deepest indentation " + digits(this.motion.deepest) + " " + this.motion.length;
    },
    views() {
      const gap = this.motion.gap, top = Math.max(...gap, this.rest), bottom = Math.min(...gap, 0), all = top - bottom;
      const near = bottom < 0 ? -bottom : Math.min(...gap), least = 0.02 * all;
      const view = (name, title, left, width, low, high, rest) => {
        const scale = 164 / (high - low);
        return { name, title, left, width, rest, scale, y: (h) => 180 - (h - low) * scale, bar: round(Math.min(45, width / 3) / scale) };
      };
      return [
        view("whole", "whole motion", 0, 158, bottom - 0.16 * all, top + 0.5 * all, true),
        view("close", "at the surface", 172, 158, -2 * Math.max(near, least), 4 * Math.max(near, least), false),
      ];
    },
    arrow() {
      const view = this.views[1], apex = Math.max(22, Math.min(174, view.y(this.motion.gap[this.now])));
      const length = (60 * this.force) / (this.motion.peak || 1), x = view.left + view.width / 2;
      if (Math.abs(length) < 0.5) return "";
      const end = apex - length, head = Math.sign(length) * Math.min(6, Math.abs(length));
      return "M" + x + " " + apex + "V" + end + "M" + (x - 4) + " " + (end + head) + "L" + x + " " + end + "L" + (x + 4) + " " + (end + head);
    },
    contacts() {
      const spans = [];
      this.motion.gap.forEach((gap, n) => {
        if (gap >= 0) return;
        if (spans.length && spans.at(-1)[1] === n - 1) spans.at(-1)[1] = n;
        else spans.push([n, n]);
      });
      return spans;
    },
    paths() {
      return Object.fromEntries(this.motion.traces.map((trace) => [
        trace.name,
        this.path(trace, trace.values),
      ]));
    },
  },
  watch: {
    motion(motion) {
      if (motion && this.now >= motion.gap.length) this.now = 0;
    },
    moving(moving) {
      if (moving) this.move();
    },
  },
  mounted() {
    this.playing = !window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (this.moving) this.move();
  },
  beforeUnmount() {
    cancelAnimationFrame(this.frame);
  },
  methods: {
    digits,
    path(trace, values) {
      return "M" + values.map((value, n) => this.across(n).toFixed(1) + " " + this.up(trace, value).toFixed(1)).join("L");
    },
    move() {
      if (this.frame) return;
      let last = performance.now(), at = this.now;
      const step = (time) => {
        this.frame = this.moving ? requestAnimationFrame(step) : null;
        if (!this.frame) return;
        if (Math.round(at) !== this.now) at = this.now;
        const since = Math.max(0, time - last); // a frame may have begun before the button was pressed
        at = (at + (since / 1000 / PERIOD) * (this.count / this.motion.periods)) % this.count;
        this.now = Math.min(this.count - 1, Math.round(at));
        if (this.now === 0) at = 0;
        last = time;
      };
      this.frame = requestAnimationFrame(step);
    },
    scrub(now) {
      this.playing = false;
      this.now = now;
    },
    low(trace) { return trace.low; },
    high(trace) { return trace.high; },
    across(n) { return 64 + (264 * n) / (this.count - 1); },
    up(trace, value) { return 56 - (52 * (value - trace.low)) / (trace.high - trace.low || 1); },
    bar(view) {
      const x = view.left + 10, length = view.bar * view.scale;
      return "M" + x + " 184v6m0 -3h" + length + "m0 -3v6";
    },
    // a sphere of the tip's radius that goes over into a cone
    tip(view) {
      const apex = view.y(this.motion.gap[this.now]), x = view.left + view.width / 2, r = Math.max(this.motion.radius * view.scale, 1.5);
      const slope = Math.PI / 9, dx = r * Math.cos(slope), dy = r * (1 - Math.sin(slope)), up = Math.max(0, (view.rest ? TALL : 400) - dy);
      return "M" + (x - dx) + " " + (apex - dy) + "A" + r + " " + r + " 0 0 0 " + (x + dx) + " " + (apex - dy) +
        "l" + up * Math.tan(slope) + " " + -up + "H" + (x - dx - up * Math.tan(slope)) + "Z";
    },
    lever(view) {
      const gap = this.motion.gap[this.now], x = view.left + view.width / 2, top = view.y(gap) - TALL, base = view.y(this.rest) - TALL;
      return "M" + (view.left - 4) + " " + base + "C" + (x - 40) + " " + base + " " + (x - 30) + " " + top + " " + (x + 22) + " " + top;
    },
  },
};
