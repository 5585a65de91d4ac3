// One field of a form: label with symbol, text and unit, its error, and advice on it.
const ROOM = 14; // letters beside a unit
export default {
  template: `
    <div class="df-entry" :class="{wrong: error, wide: kind === 'text' && !numeric && !known.length}" :data-path="path" :data-help="help"
         :data-name="path">
      <label :for="uid" class="df-label">
        <span class="df-name">{{ label }}</span><span v-if="symbol" class="df-symbol" v-html="symbol"></span>
      </label>
      <div class="df-control" :class="{united: units.length > 1 || (units.length && units[0] !== '1')}">
        <input v-if="kind === 'text'" :id="uid" class="df-box" type="text" :value="draft" :placeholder="hint" :title="placeholder"
               autocomplete="off" spellcheck="false" :inputmode="numeric ? 'decimal' : 'text'"
               :class="{number: numeric}" :aria-invalid="error ? 'true' : 'false'" :aria-describedby="uid + '-more'"
               :maxlength="longest" @input="typed($event.target.value)" @focus="focused = true" @blur="left"
               @keydown.enter="flush" :list="known.length ? uid + '-known' : undefined" />
        <select v-else-if="kind === 'choice'" :id="uid" class="df-box" :value="now.text"
                :aria-describedby="uid + '-more'" @change="send($event.target.value, '')">
          <option v-for="option in options" :key="option.value" :value="option.value">{{ option.label }}</option>
        </select>
        <input v-else :id="uid" class="df-switch" type="checkbox" role="switch" :checked="now.text === 'true'"
               :aria-describedby="uid + '-more'"
               @change="send($event.target.checked ? 'true' : 'false', '')" />
        <select v-if="units.length > 1" class="df-unit" :value="now.unit" :aria-label="'unit of ' + label"
                @change="flush(); $emit('unit', $event.target.value)">
          <option v-for="one in units" :key="one" :value="one">{{ pretty(one) }}</option>
        </select>
        <span v-else-if="units.length && units[0] !== '1'" class="df-unit alone">{{ pretty(units[0]) }}</span>
        <button v-if="slidable" type="button" class="df-slide" :class="{on: sliding}" :aria-pressed="sliding ? 'true' : 'false'"
                :aria-label="(sliding ? 'take off the slider: ' : 'put on a slider: ') + label"
                :title="sliding ? 'Take off the slider' : 'Put on a slider'" @click="$emit('slider')">
          <svg viewBox="0 0 16 16" aria-hidden="true"><path d="M1 8h4M11 8h4" /><circle cx="8" cy="8" r="3" /></svg>
        </button>
      </div>
      <datalist v-if="known.length" :id="uid + '-known'"><option v-for="one in known" :key="one" :value="one"></option></datalist>
      <div :id="uid + '-more'" class="df-more">
        <div v-if="error" class="df-error" role="alert">{{ error }}</div>
        <div v-else-if="note" class="df-note">{{ note }}</div>
        <div v-for="piece in advice" :key="piece" class="df-advice">{{ whole(piece) }}</div>
        <span class="df-hidden">{{ help }}</span>
      </div>
    </div>`,
  props: {
    kind: { default: "text" }, path: { default: "" }, label: { default: "" }, symbol: { default: "" },
    help: { default: "" }, text: { default: "" }, unit: { default: "" }, units: { default: () => [] },
    options: { default: () => [] }, placeholder: { default: "" }, error: { default: "" }, note: { default: "" },
    known: { default: () => [] }, advice: { default: () => [] }, numeric: Boolean, slidable: Boolean, sliding: Boolean,
    longest: { default: 100 },
  },
  data() {
    return { draft: this.text, focused: false, timer: null, uid: "", taken: null };
  },
  computed: {
    now() {
      return this.taken ?? { text: this.text, unit: this.unit };
    },
    // words that have no room are read with the help of the field
    hint() {
      return this.numeric && this.placeholder.length > ROOM ? "default" : this.placeholder;
    },
  },
  created() {
    this.uid = "entry-" + Math.random().toString(36).slice(2);
  },
  watch: {
    // current input is not replaced; when the field is left it shows the value that was read
    now(now, before) {
      if (!this.focused || (now.unit !== before.unit && this.timer === null)) this.draft = now.text;
    },
    text() {
      this.taken = null;
    },
    unit() {
      this.taken = null;
    },
  },
  beforeUnmount() {
    clearTimeout(this.settling);
    clearTimeout(this.timer); // the server knows this field no more
  },
  methods: {
    whole: (text) => window.dforceWhole(text),
    // a value that changes many times a second comes this way: properties would draw the whole page anew
    take(text, unit) {
      this.taken = { text, unit };
    },
    typed(text) {
      this.draft = text;
      clearTimeout(this.timer);
      this.timer = setTimeout(this.flush, 150);
    },
    flush() {
      if (this.timer === null) return;
      clearTimeout(this.timer);
      this.timer = null;
      this.send(this.draft, this.now.unit);
    },
    send(text, unit) {
      this.$emit("typed", { text, unit, number: dforceUnsent.put(this.path, text, unit) });
    },
    left() {
      this.focused = false;
      this.flush();
      this.settle();
    },
    settle() {
      clearTimeout(this.settling);
      this.settling = setTimeout(() => {
        if (dforceUnsent.all()[this.path]) this.settle(); // the server has not read this input yet
        else if (!this.focused && !this.error) this.draft = this.now.text;
      }, 400);
    },
    pretty(unit) {
      return unit
        .replace(/^u(?=[a-zA-Z])/, "µ")
        .replace(/^deg$/, "°")
        .replace(/^degC$/, "°C")
        .replace(/\^(-?\d)/g, (_, n) => ({ 2: "²", 3: "³" })[n] ?? "^" + n)
        .replace(/ /g, "·");
    },
  },
};
