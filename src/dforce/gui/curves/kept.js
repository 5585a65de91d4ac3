// The results that are kept, as a row of names with colors: hide, rename, remove, and show the differences.
export default {
  template: `
    <div class="df-kept" role="group" aria-label="results kept">
      <button type="button" class="df-plain" :disabled="!now" title="Keep this result, to compare it with others"
              @click="$emit('keep')">Keep</button>
      <span v-for="one in items" :key="one.id" class="df-chip" :class="{off: !one.shown}">
        <button type="button" class="df-eye" :aria-pressed="one.shown ? 'true' : 'false'" :aria-label="'draw ' + one.name"
                :title="one.shown ? 'Hide' : 'Draw'" @click="$emit('shown', {id: one.id, shown: !one.shown})">
          <span class="df-dot" :style="{'--df-dot': 'var(--df-series-' + one.color + ')'}"></span></button>
        <input v-if="one.id === renaming" class="df-rename" type="text" :value="one.name" :maxlength="longest" ref="field"
               aria-label="name of the result" @keydown.enter="rename(one, $event)" @keydown.esc="renaming = ''"
               @blur="rename(one, $event)" />
        <button v-else type="button" class="df-chip-name" :title="one.name + ' (press to rename)'" @click="begin(one)">
          {{ one.name }}</button>
        <button type="button" class="df-remove" :aria-label="'remove ' + one.name" title="Remove"
                @click="$emit('remove', one.id)">×</button>
      </span>
      <span v-if="now && items.some((one) => one.shown)" class="df-chip" title="The curve that follows the fields">
        <span class="df-eye"><span class="df-dot" style="--df-dot: var(--df-series-0)"></span></span>
        <span class="df-chip-name">now</span></span>
    </div>`,
  props: { items: { default: () => [] }, now: Boolean, longest: { default: 100 } },
  data() {
    return { renaming: "" };
  },
  methods: {
    begin(one) {
      this.renaming = one.id;
      this.$nextTick(() => {
        const field = [this.$refs.field].flat()[0];
        field?.focus();
        field?.select();
      });
    },
    rename(one, event) {
      if (this.renaming !== one.id) return;
      this.renaming = "";
      const name = event.target.value.trim();
      if (name && name !== one.name) this.$emit("rename", { id: one.id, name });
    },
  },
};
