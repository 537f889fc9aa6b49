"""The quick tests, ``pytest -m quick``: some of every room, which take less than 20 s of
processor time together, and no others are imported for them."""

QUICK: dict[str, tuple[str, ...]] = {
    "test_units.py": (
        "test_reads_what_people_write",
        "test_quantities_as_people_write_them",
        "test_a_hint_says_what_to_write",
    ),
    "test_quantity.py": (
        "test_every_variable_of_a_file_is_there_with_its_units",
        "test_every_number_of_a_study_has_field_units",
    ),
    "analysis/test_comparison.py": ("test_nothing_differs_from_itself", "test_what_cannot_be_compared_is_said"),
    "app/test_python.py": ("test_a_carried_chain_hands_on_its_state",),
    "benchmarks/test_limit.py": ("test_stick_slip_approaches_the_limit_cycle_of_coulombs_friction",),
    "cli/test_overrides.py": ("test_study_as_it_was_run", "test_a_title_stays_short"),
    "compiler/test_forms.py": (
        "test_compiled_lanes_have_the_values_of_python",
        "test_every_name_is_remembered_as_it_is_last",
    ),
    "compiler/test_refusals.py": ("test_what_the_language_does_not_have_is_refused",),
    "docs/test_docs_book.py": (
        "test_every_key_of_the_study_is_documented",
        "test_every_command_and_option_is_documented",
        "test_tables_are_up_to_date",
    ),
    "kernel/test_order.py": ("test_a_pair_has_its_order_and_embeds_one_less", "test_short_runs_equal_scipy"),
    "main_model/test_coefficients.py": ("test_coefficients_equal_the_reference", "test_forces_equal_the_reference"),
    "main_model/test_laws.py": ("test_every_law_has_its_word", "test_derivatives_equal_the_reference"),
    "models/test_declared.py": (
        "test_every_response_has_its_threshold_bounds_and_variables",
        "test_no_slip_falls_more_steeply_than_the_law_says",
    ),
    "observe/test_motion_kinds.py": ("test_the_cascade_of_the_logistic_map", "test_the_kind_of_motion"),
    "orbit/test_published.py": ("test_van_der_pol", "test_singular_matrices"),
    "figures/test_plot_api.py": ("test_default_kinds", "test_unknown_kind_lists_the_kinds_with_a_line_each"),
    "regenerative/test_surface.py": (
        "test_the_threshold_falls_with_the_root_of_the_number_of_blades",
        "test_the_damping_of_the_pipe_is_that_of_a_wave",
    ),
    "script/test_declared_model.py": (
        "test_called_with_numbers_it_gives_numbers",
        "test_pairs_frames_and_states_of_first_order",
    ),
    "segments/test_right_hand_side.py": ("test_the_lanes_have_the_rates_of_the_equations", "test_steady_drilling"),
    "store/test_layout.py": ("test_the_file_is_netcdf", "test_labels_are_put_where_their_points_are"),
    "study/test_load.py": (),
    "survival/test_signals.py": ("test_when_a_signal_is_acted_on",),
    "sweep/test_plan.py": (
        "test_a_point_is_found_by_its_values",
        "test_a_sweep_over_the_rock_has_the_bits_of_single_runs",
    ),
    "test_quick.py": (),
    "transcripts/test_played.py": (),
    "web/test_session.py": ("test_a_diagram_has_the_peaks_of_the_file", "test_wrong_requests_are_refused_in_words"),
}
"""The functions of each file, all where there are none."""
