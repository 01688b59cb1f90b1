/* Complete saved states of a slave, in memory and as bytes. */

#define STATE_MAGIC 0x7461757477697265ULL

typedef struct {
  State state;
  DelayLine delay_line;
} SavedState;

typedef struct {
  uint64_t magic, model, segments, checksum;
} StateHeader;

static void free_saved_state(SavedState *saved) {
  if (!saved) return;
  free_delay_line(&saved->delay_line);
  free(saved);
}

/* Saves into `saved`, or anew where that is NULL; NULL where memory is exhausted. */
static SavedState *save_state(const Slave *slave, SavedState *saved) {
  SavedState *target = saved ? saved : (SavedState *)calloc(1, sizeof *target);
  if (!target) return NULL;
  target->state = slave->state;
  target->state.saved_phase = slave->phase;
  if (copy_delay_line(&target->delay_line, &slave->delay_line)) return target;
  if (!saved) free_saved_state(target);
  return NULL;
}

/* In model exchange an importer may roll back from an event into continuous time, or to the end of initialization. */
static void restore_phase(Slave *slave) {
  int phase = slave->state.saved_phase;
  if (!slave->is_model_exchange) return;
  if (phase == INITIALIZATION || phase == EVENTS || phase == CONTINUOUS_TIME) slave->phase = (Phase)phase;
}

static int restore_state(Slave *slave, const SavedState *saved) {
  int is_other = memcmp(slave->state.real + FIRST_PARAMETER, saved->state.real + FIRST_PARAMETER,
                        (VARIABLE_COUNT - FIRST_PARAMETER) * sizeof(double)) != 0;
  if (!copy_delay_line(&slave->delay_line, &saved->delay_line)) return STATUS_ERROR;
  slave->state = saved->state;
  restore_phase(slave);
  slave->outputs_stale = 1;
  if (is_other) parameters_changed(slave);
  return STATUS_OK;
}

/* Hash of bytes (FNV-1a, 64 bits). */
static uint64_t hash_bytes(const void *bytes, size_t count, uint64_t hash) {
  const unsigned char *byte = (const unsigned char *)bytes;
  size_t k;
  for (k = 0; k < count; k++) hash = (hash ^ byte[k]) * 0x100000001b3ULL;
  return hash;
}

static size_t segment_bytes(size_t count) { return count * SEGMENT_SIZE * sizeof(double); }

static size_t serialised_size(const SavedState *saved) {
  return sizeof(StateHeader) + sizeof(State) + segment_bytes(saved->delay_line.count);
}

static StateHeader state_header(const State *state, const double *segments, size_t count) {
  StateHeader header;
  header.magic = STATE_MAGIC;
  header.model = hash_bytes(MODEL_STRUCTURE, strlen(MODEL_STRUCTURE), 0xcbf29ce484222325ULL);
  header.segments = count;
  header.checksum = hash_bytes(state, sizeof *state, header.model);
  header.checksum = hash_bytes(segments, segment_bytes(count), header.checksum);
  return header;
}

static void serialise_state(const SavedState *saved, char *bytes) {
  StateHeader header = state_header(&saved->state, saved->delay_line.segments, saved->delay_line.count);
  memcpy(bytes, &header, sizeof header);
  memcpy(bytes + sizeof header, &saved->state, sizeof saved->state);
  if (header.segments)
    memcpy(bytes + sizeof header + sizeof(State), saved->delay_line.segments, segment_bytes(saved->delay_line.count));
}

/* State from its bytes; NULL where they are none of this model's. */
static SavedState *deserialise_state(const char *bytes, size_t size) {
  StateHeader header, expected;
  SavedState *saved = NULL;
  size_t fixed = sizeof header + sizeof(State);
  if (size < fixed || (size - fixed) % segment_bytes(1)) return NULL;
  memcpy(&header, bytes, sizeof header);
  if (header.segments != (size - fixed) / segment_bytes(1)) return NULL;
  saved = (SavedState *)calloc(1, sizeof *saved);
  if (!saved) return NULL;
  memcpy(&saved->state, bytes + sizeof header, sizeof saved->state);
  if (!reserve_segments(&saved->delay_line, (size_t)header.segments)) {
    free_saved_state(saved);
    return NULL;
  }
  saved->delay_line.count = (size_t)header.segments;
  if (size > fixed) memcpy(saved->delay_line.segments, bytes + fixed, size - fixed);
  expected = state_header(&saved->state, saved->delay_line.segments, saved->delay_line.count);
  if (memcmp(&expected, &header, sizeof header)) {
    free_saved_state(saved);
    return NULL;
  }
  return saved;
}
