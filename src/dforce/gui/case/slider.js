// A parameter on a slider: a range with its two ends, which can be typed.
export default {
  template: `
    <div class="df-slider" :data-path="path">
      <div class="df-slider-head">
        <span class="df-slider-name"><span v-if="symbol" class="df-symbol" v-html="symbol"></span>{{ label }}</span>
        <output class="df-slider-value" :for="uid">{{ shown }}</output>
        <button type="button" class="df-remove" :aria-label="'take off the slider: ' + label" title="Take off the slider"
                @click="$emit('remove')">×</button>
      </div>
      <input :id="uid" type="range" :min="low" :max="high" :step="step" :value="value" :aria-label="label"
             :aria-valuetext="shown" @input="slide($event.target.valueAsNumber)" @change="$emit('done')" />
      <div class="df-slider-ends">
        <input type="text" inputmode="decimal" :value="low" :aria-label="'lower end of the slider of ' + label"
               @change="$emit('range', [$event.target.value, String(high)])" />
        <input type="text" inputmode="decimal" :value="high" :aria-label="'upper end of the slider of ' + label"
               @change="$emit('range', [String(low), $event.target.value])" />
      </div>
    </div>`,
  props: {
    path: { default: "" }, label: { default: "" }, symbol: { default: "" }, unit: { default: "" }, low: Number,
    high: Number, step: Number, given: Number, whole: Boolean,
  },
  data() {
    return { value: this.given, sliding: 0, uid: "slider-" + Math.random().toString(36).slice(2) };
  },
  computed: {
    shown() {
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
  },
  methods: {
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
      this.value = value;
      this.sliding = performance.now();
      this.$emit("slide", value);
    },
  },
};
