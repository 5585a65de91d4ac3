// A parameter on a slider: a range between two ends, which can be typed, and a button that plays it.
const SWEEP = 8000; // ms from one end to the other while it plays
const EVERY = 60; // ms between two values while it plays
const BETWEEN = 33; // ms between two messages: two frames of a screen
const tell = (name) => window.dispatchEvent(new CustomEvent(name));

export default {
  template: `
    <div class="df-slider" :data-path="path" role="group" :aria-label="'slider of ' + label">
      <input type="text" class="df-slider-end" inputmode="decimal" :value="tidy(low)" :aria-label="'lower end of the slider of ' + label"
             @change="range($event.target, 0)" />
      <input :id="uid" type="range" :min="low" :max="high" :step="step" :value="value" :aria-label="label"
             :aria-valuetext="shown" @input="slide($event.target.valueAsNumber)" @change="done" />
      <input type="text" class="df-slider-end" inputmode="decimal" :value="tidy(high)" :aria-label="'upper end of the slider of ' + label"
             @change="range($event.target, 1)" />
      <button type="button" class="df-slide df-play" :aria-pressed="playing ? 'true' : 'false'" :title="playing ? 'Stop' : 'Play'"
              :aria-label="(playing ? 'stop the slider: ' : 'play the slider: ') + label" @click="play">
        <svg viewBox="0 0 16 16" aria-hidden="true"><path v-if="playing" d="M5 4v8M11 4v8" /><path v-else d="M5 3l8 5-8 5z" /></svg>
      </button>
    </div>`,
  props: {
    path: { default: "" }, label: { default: "" }, unit: { default: "" }, low: Number, high: Number, step: Number, given: Number,
  },
  data() {
    return { value: this.given, sliding: 0, playing: false, uid: "slider-" + Math.random().toString(36).slice(2) };
  },
  computed: {
    shown() {
      if (this.value === undefined) return ""; // typed halfway
      const digits = Math.max(0, Math.min(9, Math.ceil(-Math.log10(this.step || 1) - 1e-9)));
      return this.value.toFixed(digits) + (this.unit && this.unit !== "1" ? " " + this.unit.replace(/^u(?=[a-zA-Z])/, "µ") : "");
    },
  },
  watch: {
    given(value) {
      if (!this.ahead()) this.value = value;
    },
  },
  beforeUnmount() {
    clearTimeout(this.later);
    if (this.playing) this.play();
    clearTimeout(this.pause);
    this.send();
  },
  methods: {
    tidy: (end) => (end === undefined ? "" : Number(end.toPrecision(4))), // the room of an end; incomplete input has none
    // the ends in use stand there until the server takes others
    range(box, which) {
      const ends = [this.low, this.high];
      this.$emit("range", ends.map((end, n) => (n === which ? box.value : String(end))));
      box.value = this.tidy(ends[which]);
    },
    // while it is dragged the hand is ahead of the server
    ahead() {
      return performance.now() - this.sliding < 600;
    },
    // a value that came from elsewhere, such as a step back: once the hand is off it is shown
    take(value) {
      clearTimeout(this.later);
      if (this.ahead()) this.later = setTimeout(() => this.take(value), 100);
      else this.value = value;
    },
    slide(value) {
      clearTimeout(this.later);
      tell("df-hold"); // the axes stand still
      this.value = value;
      this.sliding = performance.now();
      this.next = value;
      if (!this.pause) this.send();
    },
    // of the values since the last message the newest
    send() {
      this.pause = null;
      if (this.next === undefined) return;
      this.$emit("slide", this.next);
      this.next = undefined;
      this.pause = setTimeout(this.send, BETWEEN);
    },
    done() {
      tell("df-release");
    },
    // from one end to the other and back, by whole steps
    play() {
      this.playing = !this.playing;
      clearInterval(this.timer);
      if (!this.playing) return this.done();
      const span = this.high - this.low || 1, begun = performance.now(), from = (this.value - this.low) / span;
      this.timer = setInterval(() => {
        const turn = (from + (performance.now() - begun) / SWEEP) % 2, share = turn < 1 ? turn : 2 - turn;
        const value = this.low + Math.round((share * span) / this.step) * this.step;
        if (value !== this.value) this.slide(Number(value.toPrecision(9)));
      }, EVERY);
    },
  },
};
