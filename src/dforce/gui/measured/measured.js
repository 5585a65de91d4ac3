// A measured curve beside the plots: its facts, its shift, and a fit of parameters to it.
export default {
  template: `
    <aside class="df-motion df-measured" aria-label="measured curve">
      <div class="df-motion-head"><h2>{{ name }}</h2>
        <template v-if="ready">
          <span class="df-text" role="status">{{ missingStep || words || (failed && "Nothing was fitted.") }}</span>
          <progress v-if="busy" max="1" :value="share || undefined" aria-label="progress of the fit"></progress>
          <button v-if="!busy" type="button" class="df-plain df-main-button" @click="$emit('fit')" :disabled="!!missingStep"
                  :aria-describedby="unconfirmed ? 'df-unconfirmed' : undefined">Fit</button>
          <button v-else type="button" class="df-plain" @click="$emit('stop')">Stop</button>
        </template></div>
      <div><p v-if="wrong" class="df-motion-note wrong" role="alert">{{ wrong }}</p>
      <ul class="df-facts"><li v-for="fact in facts" :key="fact">{{ fact }}</li></ul>
      <p v-if="hint" class="df-motion-note">{{ hint }}</p>
      <p v-for="doubt in doubts" :key="doubt" class="df-motion-note">{{ whole(doubt) }}</p>
      <label v-if="ready" class="df-shift"><span>Heights are shifted by
          <input class="df-box number" type="number" step="0.01" :value="at" aria-label="shift of the heights in nm"
                 @change="shift($event.target)" /> nm</span>
        <input type="range" :min="low" :max="high" step="0.01" :value="at" aria-label="shift of the heights"
               @input="shift($event.target)" /></label>
      <div class="df-measured-buttons">
        <button v-if="ready" type="button" class="df-plain" :title="match" @click="$emit('match')">Match the experiment</button>
        <button type="button" class="df-plain" @click="$emit('remove')">Remove the curve</button></div>
      <details v-if="history.length" class="df-folded"><summary>Steps of reading and calibration</summary>
        <ul class="df-facts"><li v-for="line in history" :key="line">{{ line }}</li></ul></details></div>
      <template v-if="ready">
        <div><h3>Which lever and tip?</h3>
        <div class="df-lever">
          <label class="df-lever-name">Lever of the library
            <input class="df-box" list="df-levers" :disabled="busy" placeholder="type to search"
                   @change="$emit('library', $event.target.value); $event.target.value = ''" /></label>
          <datalist id="df-levers"><option v-for="one in levers" :key="one" :value="one"></option></datalist>
          <label v-for="one in typed" :key="one.name"><i>{{ one.name }}</i>
            <input class="df-box" :value="drafts[one.name] ?? one.text" maxlength="40" :disabled="busy"
                   :aria-label="one.name + ' of lever and tip'" :placeholder="'type ' + one.name"
                   @input="drafts[one.name] = $event.target.value" @change="typed_in(one.name)" /></label></div>
        <p v-if="missing" class="df-motion-note" role="status">{{ missing }}</p>
        <template v-if="unconfirmed">
          <div class="df-measured-buttons"><button type="button" class="df-plain" :disabled="!lever"
              @click="$emit('confirm')">Confirm lever and tip</button></div>
          <p class="df-motion-note" id="df-unconfirmed">{{ unconfirmed }}</p>
        </template>
        <p v-else class="df-text">Confirmed for this curve: {{ whole(lever) }}.</p></div>
        <div><h3>Fit</h3>
        <p v-if="free.length" class="df-text">Finds {{ free.join(", ") }}, from the values in the form.</p>
        <p v-else class="df-text">Tick <b>fit</b> at the fields of the form: the fit finds these parameters.</p>
        <p v-if="failed" class="df-motion-note wrong" role="alert">{{ failed }}</p>
        <template v-if="report">
          <p v-if="stale" class="df-motion-note">This fit is of another case than the one in the forms.</p>
          <p v-for="note in notes" :key="note" class="df-motion-note">{{ whole(note) }}</p>
          <ul class="df-facts df-answers" role="status"><li v-for="one in answers" :key="one">{{ whole(one) }}</li></ul>
          <p class="df-text">{{ whole(summary) }}</p>
          <ul class="df-facts"><li v-for="one in others" :key="one">{{ whole(one) }}</li></ul>
          <div class="df-measured-buttons">
            <button type="button" class="df-plain" @click="$emit('take')">Take over these values</button>
            <button type="button" class="df-plain" @click="$emit('report')">Save the report</button></div>
          <details class="df-folded"><summary>Report</summary><pre class="df-report">{{ report }}</pre></details>
        </template></div>
        <div v-if="report"><h3>Safe settings for this sample</h3>
          <div class="df-measured-buttons">
            <label class="df-text">Peak force at {{ set_point }} below
              <input class="df-box number df-limit" v-model="wanted" maxlength="40" aria-label="largest peak force" /></label>
            <button v-if="!finding" type="button" class="df-plain" @click="$emit('safe', wanted)">Find safe settings</button>
            <button v-else type="button" class="df-plain" @click="$emit('unsafe')">Stop</button>
            <progress v-if="finding" max="1" :value="found || undefined" aria-label="progress of the safe settings"></progress></div>
          <p v-if="unsafe" class="df-motion-note wrong" role="alert">{{ unsafe }}</p>
          <ul v-if="findings.length" class="df-facts df-findings" role="status"><li v-for="one in findings" :key="one">{{ whole(one) }}</li></ul></div>
      </template>
    </aside>`,
  props: {
    name: { default: "" }, wrong: { default: "" }, facts: { default: () => [] }, hint: { default: "" }, ready: Boolean,
    low: { default: -5 }, high: { default: 5 }, at: { default: 0 }, match: { default: "" }, history: { default: () => [] },
    lever: { default: "" }, unconfirmed: { default: "" }, levers: { default: () => [] }, typed: { default: () => [] },
    missing: { default: "" }, findings: { default: () => [] }, finding: Boolean, unsafe: { default: "" }, limit: { default: "" },
    set_point: { default: "" }, found: { default: 0 }, doubts: { default: () => [] },
    free: { default: () => [] }, busy: Boolean, share: { default: 0 }, words: { default: "" }, failed: { default: "" },
    report: { default: "" }, stale: Boolean, notes: { default: () => [] }, summary: { default: "" }, answers: { default: () => [] }, others: { default: () => [] },
  },
  data() {
    return { wanted: this.limit || "1 nN", drafts: {} }; // drafts: no update from the server overwrites current input
  },
  computed: {
    missingStep() {
      if (this.busy) return "";
      return this.unconfirmed ? "Confirm lever and tip to fit." : this.free.length ? "" : "Tick “fit” at a field to fit it.";
    },
  },
  methods: {
    whole: (text) => window.dforceWhole(text),
    typed_in(name) {
      this.$emit("lever", { name, text: this.drafts[name] });
      delete this.drafts[name];
    },
    shift(field) {
      if (Number.isFinite(field.valueAsNumber)) this.$emit("shift", field.valueAsNumber);
    },
  },
};
