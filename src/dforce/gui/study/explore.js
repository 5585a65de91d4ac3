// Results over parameters: what is looked at, a chart of it, and what a click takes over.
export default {
  template: `
    <aside class="df-motion df-explore" aria-label="over parameters">
      <div class="df-motion-head"><h2>{{ title || "Against a parameter, at the set point" }}</h2></div>
      <details class="df-folded df-vary-fold" :open="!title"><summary>Compute against a parameter</summary>
      <form class="df-vary" @submit.prevent="compute">
        <label>Vary <select class="df-box" v-model="path" :disabled="busy" @change="$emit('suggest', path)">
          <option v-for="row in rows" :key="row.name" :value="row.name">{{ row.label }}</option></select></label>
        <label>from <input class="df-box" v-model="low" maxlength="40" /></label>
        <label>to <input class="df-box" v-model="high" maxlength="40" /></label>
        <label>in <input class="df-box number df-few" type="number" min="2" :max="most" v-model="points" /> values</label>
        <button v-if="!busy" type="submit" class="df-plain df-main-button">Compute</button>
        <button v-else type="button" class="df-plain" @click="$emit('stop')">Stop</button>
        <progress v-if="busy" max="1" :value="share || undefined" aria-label="progress"></progress>
        <span class="df-text" role="status">{{ words }}</span>
      </form></details>
      <p v-if="failed" class="df-motion-note wrong" role="alert">{{ failed }}</p>
      <p v-if="note" class="df-motion-note">{{ note }}</p>
      <div v-if="quantities.length" class="df-vary">
        <label>Show <select class="df-box" :value="quantity" @change="choose({quantity: $event.target.value})">
          <option v-for="one in quantities" :key="one.name" :value="one.name">{{ one.label }}</option></select></label>
        <label>across <select class="df-box" :value="x" @change="choose({x: $event.target.value})">
          <option v-for="one in axes" :key="one.name" :value="one.name">{{ one.label }}</option></select></label>
        <label v-if="axes.length > 1">up <select class="df-box" :value="y" @change="choose({y: $event.target.value})">
          <option v-if="lines" value="">nothing: as lines</option>
          <option v-for="one in axes.filter((one) => one.name !== x)" :key="one.name" :value="one.name">{{ one.label }}</option></select></label>
        <label v-for="one in slices" :key="one.name">at {{ one.label }}
          <select class="df-box" :value="one.at" @change="choose({places: {[one.name]: Number($event.target.value)}})">
            <option v-for="(place, n) in one.places" :key="n" :value="n">{{ place }}</option></select></label>
        <template v-if="!y"><label class="df-check"><input type="checkbox" :checked="limited"
            @change="$emit('limit', {on: $event.target.checked})" /> Limit</label>
          <template v-if="limited"><select class="df-box" aria-label="allowed side" :value="above ? 'above' : 'below'"
              @change="$emit('limit', {above: $event.target.value === 'above'})">
            <option value="below">at most</option><option value="above">at least</option></select>
          <input class="df-box" :value="limit" aria-label="limit" maxlength="40" @change="$emit('limit', {text: $event.target.value})" /></template></template>
      </div>
      <p v-if="allowed" class="df-text" role="status">{{ allowed }}</p>
      <div v-if="quantities.length" class="df-measured-buttons df-picked"><span>{{ picked || "Click on a point to take over its settings." }}</span>
        <button v-if="picked" type="button" class="df-plain" @click="$emit('take')">Take over these settings</button></div>
    </aside>`,
  props: {
    title: { default: "" }, rows: { default: () => [] }, suggested: { default: () => ({}) }, most: { default: 101 }, busy: Boolean,
    share: { default: 0 }, words: { default: "" }, failed: { default: "" }, note: { default: "" }, quantities: { default: () => [] },
    quantity: { default: "" }, axes: { default: () => [] }, x: { default: "" }, y: { default: "" }, lines: Boolean,
    slices: { default: () => [] }, limited: Boolean, above: Boolean, limit: { default: "" }, allowed: { default: "" },
    picked: { default: "" },
  },
  data() {
    return { path: "", low: "", high: "", points: 21 };
  },
  watch: {
    suggested: { immediate: true, handler(one) { Object.assign(this, one); } },
  },
  methods: {
    choose(changed) {
      this.$emit("choose", changed);
    },
    compute() {
      this.$emit("compute", { path: this.path, low: this.low, high: this.high, points: Number(this.points) });
    },
  },
};
