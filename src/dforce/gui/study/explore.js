// Results over parameters: the choice, its chart, and the values that a click takes over.
const KEPT = "dforce-against"; // input here, for a page that is loaded anew
const TYPED = ["path", "low", "high", "points", "path2", "low2", "high2", "points2", "limited_", "above_", "limit_", "regime", "all"];
const differ = (one, before) => JSON.stringify(one) !== JSON.stringify(before);

export default {
  template: `
    <aside class="df-motion df-explore" aria-label="over parameters">
      <div class="df-motion-head"><h2>{{ title || "Against a parameter, at the set point" }}</h2></div>
      <details class="df-folded df-vary-fold" :open="!title || here"><summary>Compute against parameters</summary>
      <form class="df-vary" @submit.prevent="compute">
        <span class="df-together"><label>Vary <select class="df-box" v-model="path" :disabled="busy" @change="$emit('suggest', path)">
          <option v-for="row in rows" :key="row.name" :value="row.name">{{ row.label }}</option></select></label>
        <label>from <input class="df-box" v-model="low" @change="complete('low', unitOf(path))" maxlength="40" /></label>
        <label>to <input class="df-box" v-model="high" @change="complete('high', unitOf(path))" maxlength="40" /></label>
        <label>in <input class="df-box number df-few" type="number" min="2" :max="most" v-model="points" /> values</label></span>
        <span class="df-together"><label>and <select class="df-box" v-model="path2" aria-label="second parameter" :disabled="busy" @change="$emit('second', path2)">
          <option value="">nothing else</option>
          <option v-for="row in rows.filter((one) => one.name !== path)" :key="row.name" :value="row.name">{{ row.label }}</option></select></label>
        <template v-if="path2">
          <label>from <input class="df-box" v-model="low2" @change="complete('low2', unitOf(path2))" maxlength="40" aria-label="second from" /></label>
          <label>to <input class="df-box" v-model="high2" @change="complete('high2', unitOf(path2))" maxlength="40" aria-label="second to" /></label>
          <label>in <input class="df-box number df-few" type="number" min="2" :max="most" v-model="points2" aria-label="second values" /> values</label>
        </template></span>
        <span class="df-together"><label>Keep <select class="df-box" v-model="limited_" aria-label="quantity to keep within a limit">
          <option value="">no limit</option>
          <option v-for="one in limitable" :key="one.name" :value="one.name">{{ one.label }}</option></select></label>
        <template v-if="limited_"><select class="df-box" v-model="above_" aria-label="side of the limit">
            <option :value="false">below</option><option :value="true">above</option></select>
          <input class="df-box" v-model="limit_" @change="complete('limit_', unit)" aria-label="limit to keep" :placeholder="'1 ' + unit" maxlength="40" /></template></span>
        <label>in <select class="df-box" v-model="regime" aria-label="regime to keep">
          <option value="">any regime</option><option value="attractive">the attractive regime</option>
          <option value="repulsive">the repulsive regime</option></select></label>
        <label v-if="!path2 && !limited_ && !regime" class="df-check"><input type="checkbox" v-model="all" /> All states (slower)</label>
        <button v-if="!busy" type="submit" class="df-plain df-main-button">Compute</button>
        <button v-else type="button" class="df-plain" @click="$emit('stop')">Stop</button>
        <progress v-if="busy" max="1" :value="share || undefined" aria-label="progress"></progress>
        <span class="df-text" role="status">{{ words }}</span>
      </form></details>
      <p v-if="failed" class="df-motion-note wrong" role="alert">{{ failed }}</p>
      <p v-if="note" class="df-motion-note">{{ unbroken(note) }}</p>
      <div v-if="quantities.length" class="df-vary">
        <label>Show <select class="df-box" :value="quantity" @change="show($event.target)">
          <option v-for="one in offered" :key="one.name" :value="one.name">{{ one.label }}</option>
          <option v-if="offered.length < quantities.length" value="">more ...</option></select></label>
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
      <p v-if="allowed" class="df-text" role="status">{{ unbroken(allowed) }}</p>
      <p v-for="one in found" :key="one" class="df-text">{{ unbroken(one) }}</p>
      <div v-if="quantities.length" class="df-measured-buttons df-picked"><span>{{ picked || "Click on a point to take over its settings." }}</span>
        <button v-if="picked" type="button" class="df-plain" @click="$emit('take')">Take over these settings</button></div>
    </aside>`,
  props: {
    title: { default: "" }, here: Boolean, second: { default: () => ({}) }, limitable: { default: () => [] },
    few: { default: 10 }, found: { default: () => [] }, rows: { default: () => [] }, suggested: { default: () => ({}) }, most: { default: 101 }, busy: Boolean,
    share: { default: 0 }, words: { default: "" }, failed: { default: "" }, note: { default: "" }, quantities: { default: () => [] },
    quantity: { default: "" }, axes: { default: () => [] }, x: { default: "" }, y: { default: "" }, lines: Boolean,
    slices: { default: () => [] }, limited: Boolean, above: Boolean, limit: { default: "" }, allowed: { default: "" },
    picked: { default: "" },
  },
  data() {
    return { path: "", low: "", high: "", points: 21, path2: "", low2: "", high2: "", points2: 9, limited_: "", above_: false, limit_: "",
             regime: "", all: false, whole: false, before: JSON.parse(sessionStorage.getItem(KEPT)) };
  },
  computed: {
    unit() {
      return this.limitable.find((one) => one.name === this.limited_)?.unit;
    },
    // the first ones, and the one that is shown; all once they were asked for
    offered() {
      return this.whole ? this.quantities : this.quantities.filter((one, n) => n < this.few || one.name === this.quantity);
    },
  },
  watch: {
    // input stays unless another range is suggested
    suggested: {
      immediate: true,
      handler(one, before) {
        if (!differ(one, before)) return;
        Object.assign(this, one);
        const typed = this.before;
        if (this.rows.some((row) => row.name === typed?.path)) this.$nextTick(() => this.takeUp(typed));
        if (this.rows.length) this.before = null;
      },
    },
    second: {
      immediate: true,
      handler(one, before) {
        if (differ(one, before)) Object.assign(this, { path2: one.path ?? "", low2: one.low ?? "", high2: one.high ?? "" });
      },
    },
    path2(now, before) { if (!before !== !now) this.points = now ? 11 : 21; },
  },
  created() {
    const typed = () => JSON.stringify(Object.fromEntries(TYPED.map((name) => [name, this[name]])));
    this.$watch(typed, (text) => this.before ?? sessionStorage.setItem(KEPT, text));
  },
  methods: {
    unbroken: (text) => window.dforceWhole(text),
    // in two steps: a second parameter suggests numbers of values
    takeUp(typed) {
      Object.assign(this, typed);
      this.$nextTick(() => Object.assign(this, typed));
    },
    unitOf(path) {
      return this.rows.find((row) => row.name === path)?.unit;
    },
    // a number alone has the unit of the parameter or quantity
    complete(name, unit) {
      if (unit && unit !== "1" && /^[-+\d.,e\s]*\d\s*$/i.test(this[name])) this[name] = `${this[name].trim()} ${unit}`;
    },
    choose(changed) {
      this.$emit("choose", changed);
    },
    show(field) {
      if (field.value) return this.choose({ quantity: field.value });
      this.whole = true;
      field.value = this.quantity;
    },
    compute() {
      this.$emit("compute", {
        path: this.path, low: this.low, high: this.high, points: Number(this.points), second: this.path2, low2: this.low2,
        high2: this.high2, points2: Number(this.points2), limited: this.limited_, above: this.above_, limit: this.limit_,
        regime: this.regime, all: this.all,
      });
    },
  },
};
