// The form for reading a measured table: its head, the quantity of each column, the signs, and the curve as it would be read.
const WIDTH = 300, HEIGHT = 118, PAD = 4;

export default {
  template: `
    <form class="df-save df-table-form" @submit.prevent="send">
      <h2>{{ title }}</h2>
      <p class="df-text">{{ why }}</p>
      <div class="df-head-table"><table>
        <caption class="df-hidden">first rows of the file</caption>
        <thead><tr><th v-for="(one, n) in columns" :key="n" scope="col">{{ one.name }}<span v-if="one.unit"> ({{ one.unit }})</span></th></tr>
          <tr><td v-for="(one, n) in columns" :key="n">
            <select class="df-box" :value="roles[n]" :aria-label="'quantity of ' + one.name" :disabled="!one.numbers.length"
                    @change="choose(n, $event.target.value)">
              <option value="">not used</option>
              <option v-for="role in offered(one)" :key="role" :value="role">{{ role.replaceAll("_", " ") }}</option>
            </select>
            <input v-if="!one.unit && !isPiezo(n) && needed.includes(roles[n])" class="df-box" v-model="units[n]" maxlength="20"
                   :aria-label="'unit of ' + one.name" placeholder="unit" /></td></tr></thead>
        <tbody><tr v-for="row in rows" :key="row"><td v-for="(one, n) in columns" :key="n">{{ one.cells[row - 1] }}</td></tr></tbody>
      </table></div>
      <div class="df-table-more">
        <figure class="df-small-curve" aria-label="the curve as it is read"><template v-for="line in drawn" :key="line.name">
          <svg :viewBox="'0 0 ${WIDTH} ${HEIGHT}'" role="img" :aria-label="line.name + ' against height'">
            <path :d="line.path" class="df-small-line" /></svg>
          <figcaption>{{ line.name }} against height, sample at the left</figcaption></template>
          <p v-if="!drawn.length" class="df-text">Choose height and amplitude to see the curve.</p></figure>
        <div class="df-table-questions">
          <label class="df-save-row"><span>Larger heights are</span>
            <select class="df-box" v-model="sign"><option value="">choose ...</option>
              <option v-for="(text, key) in heights" :key="key" :value="key">{{ text }}</option></select></label>
          <label class="df-save-row"><span>Phases in the file</span>
            <select class="df-box" v-model="turn"><option value="">choose ...</option>
              <option v-for="(text, key) in phases" :key="key" :value="key">{{ text }}</option></select></label>
          <label class="df-save-row"><span>Amplitudes are</span>
            <select class="df-box" v-model="kind"><option v-if="!amplitude" value="">zero to peak (usual)</option>
              <option v-for="(text, key) in amplitudes" :key="key" :value="key">{{ text }}</option></select></label>
          <label v-if="volts" class="df-save-row"><span>Sensitivity of the detector</span>
            <input class="df-box" v-model="volt" maxlength="40" placeholder="50 nm/V" /></label>
          <label v-if="ofPiezo" class="df-save-row"><span>Sensitivity of the piezo</span>
            <input class="df-box" v-model="perVolt" maxlength="40" placeholder="20 nm/V" /></label>
          <label v-for="(one, n) in more" :key="n" class="df-save-row"><span>{{ one.label }}</span>
            <select v-if="one.options" class="df-box" v-model="values[n]">
              <option v-for="option in one.options" :key="option.value" :value="option.value">{{ option.label }}</option></select>
            <input v-else class="df-box" v-model="values[n]" maxlength="40" autocomplete="off" /></label>
          <p v-if="missing" class="df-motion-note" role="status">{{ missing }}</p>
        </div></div>
      <div class="df-save-buttons">
        <button type="button" class="df-plain" @click="$emit('cancel')">Cancel</button>
        <button type="submit" class="df-plain df-main-button" :disabled="!!missing">Read</button></div>
    </form>`,
  props: {
    title: { default: "" }, why: { default: "" }, columns: { default: () => [] }, needed: { default: () => [] },
    phases: { default: () => ({}) }, convention: { default: "" }, heights: { default: () => ({}) }, grows: { default: "" },
    amplitudes: { default: () => ({}) }, amplitude: { default: "" }, sensitivity: { default: "" }, piezo: { default: "" }, more: { default: () => [] },
  },
  data() {
    return {
      roles: this.columns.map((one) => one.role), units: this.columns.map((one) => one.typed), sign: this.grows,
      turn: this.convention, kind: this.amplitude, volt: this.sensitivity, perVolt: this.piezo, values: this.more.map((one) => one.value),
    };
  },
  computed: {
    rows() {
      return Math.max(...this.columns.map((one) => one.cells.length), 0);
    },
    volts() {
      const column = this.column("amplitude");
      return !!column && /V$/.test(column.unit || this.units[this.roles.indexOf("amplitude")]);
    },
    ofPiezo() {
      return this.columns.some((one, n) => this.isPiezo(n));
    },
    missing() {
      const none = this.needed.filter((role) => !this.roles.includes(role) && !this.roles.includes("frequency_shift"));
      if (none.length) return "Choose a column for the " + none.join(" and the ") + ".";
      if (!this.sign) return "Choose where larger heights are.";
      if (!this.turn && this.roles.includes("phase")) return "Choose the sign of the phases.";
      if (this.ofPiezo && !this.perVolt.trim()) return "Type the sensitivity of the piezo.";
      return this.volts && !this.volt.trim() ? "Type the sensitivity of the detector." : "";
    },
    drawn() {
      const across = this.column("height");
      if (!across) return [];
      return ["amplitude", "phase"].filter((name) => this.column(name)).map((name) => ({ name, path: this.path(name, across) }));
    },
  },
  methods: {
    isPiezo(n) {
      return this.columns[n].volts && this.roles[n] === "height";
    },
    column(role) {
      return this.columns[this.roles.indexOf(role)];
    },
    offered(column) {
      return [...new Set([...this.needed, column.role].filter(Boolean))];
    },
    choose(n, role) {
      this.roles = this.roles.map((other, m) => (m === n ? role : other === role ? "" : other));
    },
    path(name, across) {
      const way = this.sign === "toward" ? -1 : 1, turned = name === "phase" && ["lead", "90-lag"].includes(this.turn) ? -1 : 1;
      const points = across.numbers.map((x, n) => [way * x, turned * this.column(name).numbers[n], x, this.column(name).numbers[n]])
        .filter((point) => point[2] !== null && point[3] !== null);
      const low = [0, 1].map((k) => Math.min(...points.map((point) => point[k])));
      const span = [0, 1].map((k) => Math.max(...points.map((point) => point[k])) - low[k] || 1);
      return points.map((point, n) => (n ? "L" : "M") + (PAD + ((point[0] - low[0]) / span[0]) * (WIDTH - 2 * PAD)).toFixed(1)
        + " " + (HEIGHT - PAD - ((point[1] - low[1]) / span[1]) * (HEIGHT - 2 * PAD)).toFixed(1)).join("");
    },
    send() {
      if (this.missing) return;
      this.$emit("read", {
        roles: this.roles, units: this.units.map((unit, n) => (this.isPiezo(n) ? this.perVolt : this.columns[n].unit ? "" : unit)), grows: this.sign, convention: this.turn, amplitude: this.kind,
        sensitivity: this.volts ? this.volt : "", more: this.values,
      });
    },
  },
};
