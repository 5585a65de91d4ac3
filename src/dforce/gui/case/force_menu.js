// All force models in groups, and a search over their names, synonyms, keys and sentences.
export default {
  template: `
    <div class="df-forces">
      <h2>Add a force</h2>
      <input ref="search" class="df-box" type="search" v-model="wanted" placeholder="Search, such as adhesion or cell"
             aria-label="search the forces" maxlength="60" @keydown.down.prevent="$el.querySelector('[role=menuitem]')?.focus()"
             @keydown.enter="shown.length && $emit('take', shown[0].items[0].name)" />
      <div v-if="shown.length" role="menu" aria-label="forces" class="df-force-list">
        <div v-for="group in shown" :key="group.title" role="group" :aria-label="group.title">
          <div class="df-force-group" aria-hidden="true">{{ group.title }}</div>
          <button v-for="one in group.items" :key="one.name" type="button" role="menuitem" class="df-force-item"
                  @click="$emit('take', one.name)">
            <span class="df-menu-title">{{ one.title }}</span>
            <span class="df-menu-text">{{ one.text }}</span>
          </button>
        </div>
      </div>
      <p v-else class="df-text" role="status">No force has these words. Add “Own law” to write your own.</p>
    </div>`,
  props: { groups: { default: () => [] } },
  data() {
    return { wanted: "" };
  },
  computed: {
    shown() {
      const words = this.wanted.toLowerCase().split(/\s+/).filter(Boolean);
      const has = (one, group) => {
        const text = `${one.title} ${one.name} ${one.also} ${one.text} ${group.title}`.toLowerCase();
        return words.every((word) => text.includes(word));
      };
      return this.groups
        .map((group) => ({ title: group.title, items: group.items.filter((one) => has(one, group)) }))
        .filter((group) => group.items.length);
    },
  },
  mounted() {
    this.$nextTick(() => this.$refs.search.focus());
  },
};
