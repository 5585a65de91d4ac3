// A law that is typed: a wide field, its names as chips that are put in where the caret stands, errors while one types.
const DRAFTS = "dforce-laws"; // input that is not entered, by case and place, for a field that is made anew
const drafts = () => JSON.parse(sessionStorage.getItem(DRAFTS)) ?? {};

export default {
  template: `
    <div class="df-entry wide df-law" :class="{wrong}" :data-path="path" :data-name="path" :data-help="help">
      <label :for="uid" class="df-label"><span class="df-name">{{ label }}</span></label>
      <textarea ref="box" :id="uid" class="df-box df-law-text" rows="3" v-model="draft" :maxlength="longest" spellcheck="false"
                autocomplete="off" :aria-invalid="wrong ? 'true' : 'false'" :aria-describedby="uid + '-more'"
                @input="typed" @keydown.enter.prevent="enter"></textarea>
      <div :id="uid + '-more'" class="df-more">
        <div v-if="wrong" class="df-error" role="alert">{{ wrong }}</div>
        <div v-else-if="waiting" class="df-note" role="status">Press Enter to compute with this law. The force curve shows it already.</div>
        <span class="df-hidden">{{ help }}</span>
      </div>
      <div class="df-law-names" role="group" aria-label="names for the law">
        <button v-for="one in names" :key="one.name" type="button" class="df-law-name" :title="one.help"
                :aria-label="one.name + ': ' + one.help" @click="insert(one.name)">
          <code>{{ one.name }}</code><span v-if="one.unit" class="df-law-unit">{{ one.unit }}</span>
        </button>
      </div>
    </div>`,
  props: {
    path: { default: "" }, place: { default: "" }, label: { default: "" }, help: { default: "" }, text: { default: "" }, error: { default: "" },
    mistake: { default: "" }, // in the current input
    names: { default: () => [] }, longest: { default: 2000 },
  },
  data() {
    const typed = drafts()[this.place]; // it began with the law of the case as it was then
    return { draft: typed?.from === this.text ? typed.draft : this.text, uid: "law-" + Math.random().toString(36).slice(2) };
  },
  computed: {
    waiting() {
      return this.draft.trim() !== this.text.trim();
    },
    wrong() {
      return this.waiting ? this.mistake : this.error;
    },
  },
  watch: {
    text(text) {
      this.draft = text;
    },
  },
  mounted() {
    if (this.waiting) this.typed();
  },
  beforeUnmount() {
    clearTimeout(this.timer);
  },
  methods: {
    // input is kept in the browser until it is entered
    typed() {
      sessionStorage.setItem(DRAFTS, JSON.stringify({ ...drafts(), [this.place]: { from: this.text, draft: this.draft } }));
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.$emit("draft", this.draft), 80);
    },
    enter() {
      clearTimeout(this.timer);
      this.$emit("typed", { text: this.draft, unit: "", number: dforceUnsent.put(this.path, this.draft, "") });
    },
    insert(name) {
      const box = this.$refs.box;
      const [from, to] = [box.selectionStart, box.selectionEnd];
      this.draft = this.draft.slice(0, from) + name + this.draft.slice(to);
      this.typed();
      this.$nextTick(() => {
        box.focus();
        box.setSelectionRange(from + name.length, from + name.length);
      });
    },
  },
};
