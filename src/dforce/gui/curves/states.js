// All states at the set point or at a distance: a row for each, with a button that shows its motion.
export default {
  template: `
    <section class="df-setpoint" aria-label="coexisting states">
      <div class="df-setpoint-field" role="radiogroup" aria-label="place of the states">
        <label><input type="radio" name="df-states" :checked="!byDistance" @change="choose(false)" /> At the set point {{ share }}</label>
        <label v-if="along"><input type="radio" name="df-states" :checked="byDistance" @change="choose(true)" /> At the distance
          <input class="df-box df-limit" style="width: 84px" :value="distance" maxlength="40" placeholder="12 nm" aria-label="distance of the states"
                 @focus="typing = true" @change="$emit('distance', $event.target.value)" /></label>
        <span v-if="text" class="df-text" role="status">{{ text }}</span></div>
      <div v-if="rows.length" class="df-setpoint-rows" role="region" aria-label="coexisting states in a table" tabindex="0"><table>
        <thead><tr><th scope="col">state</th><th scope="col">stability</th>
          <th v-for="(column, n) in columns" :key="n" scope="col">{{ column.label }} <span class="df-symbol" v-html="column.symbol"></span></th>
          <th scope="col">motion</th></tr></thead>
        <tbody><tr v-for="(row, n) in rows" :key="n">
          <th scope="row"><b>{{ row.state }}</b></th><td>{{ row.stable ? "stable" : "unstable" }}</td>
          <td v-for="(cell, k) in row.cells" :key="k">{{ cell }}</td>
          <td><button type="button" class="df-plain" :aria-label="'show the motion of state ' + (n + 1)"
                      @click="$emit('motion', n)">Show</button></td></tr></tbody>
      </table></div>
    </section>`,
  props: {
    share: { default: "" }, distance: { default: "" }, along: Boolean, rows: { default: () => [] },
    columns: { default: () => [] }, text: { default: "" },
  },
  data() {
    return { typing: false }; // the distance is chosen before it is typed
  },
  computed: {
    byDistance() {
      return this.typing || this.distance !== "";
    },
  },
  methods: {
    choose(byDistance) {
      this.typing = byDistance;
      if (!byDistance) this.$emit("distance", "");
      else this.$nextTick(() => this.$el.querySelector(".df-limit").focus());
    },
  },
};
