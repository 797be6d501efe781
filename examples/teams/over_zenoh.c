/* A team's algorithm in C, with zenoh-pico and nothing of Touchline: all robots meet.

       cc -o over_zenoh examples/teams/over_zenoh.c -DZENOH_LINUX -lzenohpico -lpthread -lm
       TOUCHLINE_ENDPOINT=tcp/127.0.0.1:7480 touchline fleet run --robots 6 --algorithm external
       ./over_zenoh tcp/127.0.0.1:7480 tb1 tb2 tb3 tb4 tb5 tb6

   Questions and answers are JSON in std_msgs/String (CDR: 4 bytes of header, the length with the closing zero, the
   text). Numbers are found by the names of their fields, which is enough for the messages of Touchline. */

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zenoh-pico.h>

enum { MOST = 4096, HEADER = 8 };

static double number(const char *text, const char *field) {
    const char *at = strstr(text, field);
    return at ? strtod(at + strlen(field), NULL) : 0.0;
}

/* Write the answer to a question: to drive half of the mean way to those that were heard since the last one. */
static int answer(const char *asked, char *text) {
    double x = number(asked, "\"x_m\": "), y = number(asked, "\"y_m\": "), vx = 0.0, vy = 0.0, ox, oy;
    int heard = 0;
    for (const char *at = asked; (at = strstr(at, "\"text\": \"")); at++)
        if (sscanf(at, "\"text\": \"[%lf, %lf]", &ox, &oy) == 2) vx += ox - x, vy += oy - y, heard++;
    if (heard) vx *= 0.5 / heard, vy *= 0.5 / heard;
    return snprintf(text, MOST, "{\"update\": %.0f, \"wish\": {\"velocity\": [%.6f, %.6f]}, \"say\": \"[%.6f, %.6f]\"}",
                    number(asked, "\"update\": "), vx, vy, x, y);
}

static void on_state(z_loaned_sample_t *sample, void *publisher) {
    z_owned_slice_t asked;
    if (z_bytes_to_slice(z_sample_payload(sample), &asked) < 0) return;
    if (z_slice_len(z_loan(asked)) > HEADER) {  /* the text ends with a zero */
        char said[HEADER + MOST] = {0, 1, 0, 0};
        uint32_t length = 1 + (uint32_t)answer((const char *)z_slice_data(z_loan(asked)) + HEADER, said + HEADER);
        memcpy(said + 4, &length, sizeof length);
        z_owned_bytes_t payload;
        z_bytes_copy_from_buf(&payload, (const uint8_t *)said, HEADER + length);
        z_publisher_put(z_loan(*(z_owned_publisher_t *)publisher), z_move(payload), NULL);
    }
    z_drop(z_move(asked));
}

int main(int count, char **given) {
    z_owned_config_t config;
    z_owned_session_t session;
    z_config_default(&config);
    zp_config_insert(z_loan_mut(config), Z_CONFIG_CONNECT_KEY, count > 1 ? given[1] : "tcp/127.0.0.1:7447");
    if (z_open(&session, z_move(config), NULL) < 0) return fprintf(stderr, "nobody answers at the endpoint\n"), 1;
    for (int robot = 2; robot < count; robot++) {
        char wish[256], state[256];
        z_view_keyexpr_t out, in;
        z_owned_closure_sample_t heard;
        z_owned_publisher_t *publisher = malloc(sizeof *publisher); /* for the life of the process */
        snprintf(wish, sizeof wish, "%s/algorithm/wish", given[robot]);
        snprintf(state, sizeof state, "%s/algorithm/state", given[robot]);
        z_view_keyexpr_from_str(&out, wish);
        z_view_keyexpr_from_str(&in, state);
        z_declare_publisher(z_loan(session), publisher, z_loan(out), NULL);
        z_closure(&heard, on_state, NULL, publisher);
        z_declare_background_subscriber(z_loan(session), z_loan(in), z_move(heard), NULL);
    }
    for (;;) sleep(1);
}
