// A few questions on how something is saved.
export default {
  template: `
    <form class="df-save" :class="{wide: why}" @submit.prevent="$emit('save', values)">
      <h2>{{ title }}</h2>
      <p v-if="why" class="df-text">{{ why }}</p>
      <label v-for="(one, n) in fields" :key="n" class="df-save-row"><span>{{ one.label }}</span>
        <select v-if="one.options" class="df-box" v-model="values[n]">
          <option v-for="option in one.options" :key="option.value" :value="option.value">{{ option.label }}</option>
        </select>
        <input v-else class="df-box" type="text" v-model="values[n]" maxlength="40" autocomplete="off" />
      </label>
      <div class="df-save-buttons">
        <button type="button" class="df-plain" @click="$emit('cancel')">Cancel</button>
        <button type="submit" class="df-plain df-main-button">{{ button }}</button>
      </div>
    </form>`,
  props: { title: { default: "" }, why: { default: "" }, button: { default: "Save" }, fields: { default: () => [] } },
  data() {
    return { values: this.fields.map((one) => one.value) };
  },
};
