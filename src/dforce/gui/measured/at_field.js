// The fit of one parameter, at its field: whether it is fitted, its fitted value, and its prior.
export default {
  template: `
    <div class="df-fit-at" role="group" :aria-label="'fit of ' + label">
      <label class="df-check"><input type="checkbox" :checked="free" :disabled="busy" :aria-label="'fit ' + label"
          @change="$emit('free', $event.target.checked)" /> fit</label>
      <span v-if="found" class="df-found" :class="{behind: stale}">{{ whole(found) }}</span>
      <input v-if="free" class="df-box" :value="prior" maxlength="60" :aria-label="'prior of ' + label" :placeholder="'prior: ' + example"
             title="Prior: value and error known before the fit, such as 180(4)" @change="$emit('prior', $event.target.value)" />
      <span v-if="note" class="df-advice">{{ whole(note) }}</span>
    </div>`,
  props: {
    label: { default: "" }, free: Boolean, busy: Boolean, found: { default: "" }, stale: Boolean, note: { default: "" },
    prior: { default: "" }, example: { default: "" },
  },
  methods: { whole: (text) => window.dforceWhole(text) },
};
