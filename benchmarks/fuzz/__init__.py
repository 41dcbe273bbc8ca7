"""A coverage-guided fuzzer for every reader of bytes from outside.

``python -m benchmarks fuzz`` feeds each family of readers (`targets`) what libFuzzer and `mutations` derive from valid
examples, through atheris (`runs`). A reader may return a value or raise an exception that it documents; where
there is a writer, its output must read back as the same value. All else is a finding; its input is saved to a file.
"""
