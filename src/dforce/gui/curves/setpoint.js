// The quantities at the set point: a field for A/A0, and a row for each state in which a curve reaches it.
export default {
  template: `
    <section class="df-setpoint" aria-label="at the set point">
      <div class="df-setpoint-field"><label><svg class="df-ring" viewBox="0 0 14 14" aria-hidden="true"><circle cx="7" cy="7" r="5" /></svg> At the set point <span class="df-symbol"><i>A</i>/<i>A</i><sub>0</sub></span> =
        <input class="df-box number" type="number" :min="low" :max="high" step="1" :value="now.percent"
               aria-label="set point in percent of the free amplitude" @input="typed($event.target)" /> %</label>
        <span v-if="now.text" class="df-text" role="status">{{ now.text }}</span></div>
      <div v-if="!now.text" class="df-setpoint-rows" role="region" aria-label="states at the set point" tabindex="0"><table>
        <thead><tr><th scope="col">state</th>
          <th v-for="(column, n) in now.columns" :key="n" scope="col">{{ column.label }} <span class="df-symbol" v-html="column.symbol"></span></th></tr></thead>
        <tbody><tr v-for="(row, n) in now.rows" :key="n">
          <th scope="row"><span v-if="row.name" class="df-dot" :style="{'--df-dot': 'var(--df-series-' + row.color + ')'}"
            :title="row.name"></span> <b>{{ row.state }}</b><template v-if="row.ways">, {{ row.ways }}</template></th>
          <td v-for="(cell, k) in row.cells" :key="k">{{ cell }}</td></tr></tbody>
      </table></div>
    </section>`,
  props: {
    percent: { default: 80 }, low: { default: 1 }, high: { default: 99 }, rows: { default: () => [] },
    columns: { default: () => [] }, text: { default: "" },
  },
  data() {
    return { taken: null };
  },
  computed: {
    now() {
      return this.taken ?? this.$props;
    },
  },
  watch: {
    rows() {
      this.taken = null;
    },
  },
  methods: {
    // numbers that change many times a second come this way: properties would draw the whole page anew
    take(numbers) {
      this.taken = numbers;
    },
    typed(field) {
      if (field.validity.valid || field.validity.stepMismatch) {
        if (Number.isFinite(field.valueAsNumber)) this.$emit("percent", field.valueAsNumber);
      }
    },
  },
};
