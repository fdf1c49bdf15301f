"""Names, public folders and checksums of the CrazyPAD flights that were checked."""

from __future__ import annotations

from seals.logs.datasets import DataFile

# group -> public folder (~ stands for mm in Cyrillic letters), checksum of the offline form by log;
# m12 is E9_log12 of the motor logs, c12 that of the controller logs
_GROUPS: dict[str, tuple[str, dict[str, str]]] = {
    "E8_cut_M3_0.5": (
        "cut_propeller_M3_0.5mm_46.5mm",
        {
            "c01": "b689b021c8a8f23c501d0cba1e38fef98a65ec1fb8eedd5045c12c2f70d0f7f2",
            "c02": "bd379836de717946700d4d76a1ec4ac7c1970216221b7bc1de15951ff94d00af",
            "c03": "94c983e1bf4e6262cee831ddb767c952da3655f98ae55a8686598ed9a54f7b05",
            "m00": "aa2b748bad891553374b8daed7ff417680b261e0e49002c8916f1cac51533393",
            "m01": "6983591779edbd20ff7b18829506fcabdd349559a17ebdf0997d33259b66d639",
            "m02": "8fc34e43d438f41448435a2d635b6435e7a2a7416120a7f99d616705e3b1be1a",
        },
    ),
    "E8_cut_M3_1-1": (
        "cut_propeller_M3_1mm_1mm_45mm",
        {
            "c00": "064f1e9d3bb1ba77f390e9e33ba34a4876f5e618347b52fd8d26cc3c272b8670",
            "c01": "e019c4c1cd640773e830aef7fb6c19bab4bf86c7e05360eade5c6cd8bb719739",
            "c02": "b5a6397eb1d2cf295ca3d9f63e5fabde16970443097b386795f1eb6f242422ad",
            "m00": "797cf36498097382a2285b261a56778a9e7868d1f271f57c437f3cf4692423f3",
            "m01": "ce2b71181062cf875176aed1c815b104dfe959f55d35e61ea9cf8539118c4805",
            "m02": "7c2df844dcc90084c475fefe1603d4a53beb505f029ce58d8a45adc3b01753dc",
        },
    ),
    "E8_cut_M3_2-1.5": (
        "cut_propeller_M3_2mm_1.5mm_43.5mm",
        {
            "c00": "5c90d41f1f6a2a644e2b7c78833e624eda19412ba925b96630878bd68989799d",
            "c01": "0f1a2742c3d9109785ebae0efc3b5c26c9ec317af381f7efc3fcec25ebe66119",
            "c02": "7b6cc3c82434bb4fa85e5309829491814c362fe39fb54418e0535d37235e21e9",
            "m00": "8a634467d1fa6c8bc3b68c2f8e85286705845c00d9f9c8170df8eb3d157a35dd",
            "m01": "add1fd3224ac7618aced2094a0d94cc0478a3b20a1b7eb6528d25a66b7b9f771",
            "m02": "383773579f99ed6b3ca71cfff8b771797979f92248b617cc935112bd2cd44dc3",
        },
    ),
    "E8_cut_M3_2.5-2.5": (
        "cut_propeller_M3_2.5mm_2.5mm_42mm",
        {
            "c00": "c6942cc2ecdd31196aef5bb5beb222598fc87cbb61be71ee99bea61b0630fc73",
            "c01": "f4ff9ebb71eb98df5f2a5283abe4d119159162f6661a33c02a6000ca343aefab",
            "c02": "b5d14801c678bd0d738bf68dbe5a08d762559bb0c4f93861583dfee5b408d0f8",
            "m00": "96fb8410678f445c33873ea6e1f2ec3f8da880d7c73774940945d11a530d84cb",
            "m01": "9e4bfd3cbc6130a3f078b314c998ef3125ef48aef1cc738e223c2d4465fe5b7a",
            "m02": "8458abce05410b168e79e65ceeb502c1427eed104b9537429dc25a12eba6f76f",
        },
    ),
    "E8_cut_M3_2one": (
        "cut_propeller_M3_2mm",
        {
            "c00": "2f062c42271e9acbf0e7dd0b83230ea4bd5ee4638b234d56fd97a0433e8ed3f2",
            "c01": "f23276380cba1b17114481d3979560d6153f78bad54cf7bced38fcd6527219f1",
            "c02": "6692770565fa5b7f7280160c0b18a262cb13736a984c89bd98c818d201afa0c8",
            "m00": "8432c5b72e787bc8c2e8f8159d2cd02f97707356c68aabc76ffe96d136e2dfef",
            "m01": "624abd1acf0bf0753f039af943225712eec5f31a45aaeea592a522861bbc989c",
            "m02": "27863532c400f507b8515d394e04a975396a580b9a738df00c1cb58b927d7c10",
        },
    ),
    "E8_cut_M3_3-3": (
        "cut_propeller_M3_3mm_3mm_41mm",
        {
            "c00": "faf222b49f2f692c12e44517393bcc8d1bd50206e8f77b551d70a3c5ef8911be",
            "c01": "6659abeea5071ff24f278494698b21fb946c4a5bec99cdfffb545e7a5b7ae806",
            "c02": "daf5203a544820ce511d47f4f54bf411632aedfcd548f56d7f4ad54a4988929d",
            "m00": "1d5a882335270efcc84c6dfea484d972f03a56e02a918e4d4d068c6bd024dfed",
            "m01": "ab31da6cb1d10db8a4fc4a015e2562391d1ed790a8c120dbaa349ff7cecc495c",
            "m02": "7fbe24c6f8cefc70bfaf01e5b15cb106e3cc36ecacf55bc1fc8884aa4dec09ad",
        },
    ),
    "E8_cut_M3_4-3.5": (
        "cut_propeller_M3_4mm_3.5mm_39.5mm",
        {
            "c00": "a1b66cbaa6edce7954465b8f2f45b72fb2b323d261428c96c4d71b35045a560f",
            "c02": "18dc8ad05e04ac9f1e83bb8b8609efd77dac05052998e24ed8148b4b7243a0fa",
            "c03": "20a46854a9d2b4ca823aaf6118d2c290183cd95d3fe75994d6951b4f81f5cb53",
            "m00": "48a252d5cf24697ece2bb76be151c6875cf8f511aac0c30c001e1eb1f4cfc4a1",
            "m01": "c17d95d366f542dc0dec6bc4697efcbaac36cfd56323249d939a18ac806da492",
            "m02": "92c02b49f608d6d7c6ee593a0a6867ad42f512baf49989efeff13a3ec6cacadc",
        },
    ),
    "E8_normal": (
        "normal_flight",
        {
            "c00": "f427ff8635920cdb3afd22bd5423d014fa3eef7b7bf2151e09fd776173087c97",
            "c03": "0f9452c0379147537fe1abcc93c5709be681736909af0d59d534200233ad6a55",
            "m00": "def2d149e84cfc488af9f4e655c85e419614677f0cdbadd89db94d455f6e19f9",
            "m03": "d86d2c5fe0c89d436b861e86dad987da222a55e5e62de9746766bb7618790d1f",
            "m05": "14e90f2d8cb3e25c117f47fb484104308c7663cd6d3c41a564896985d26a0cde",
        },
    ),
    "E8_string_M3_W2": (
        "weight_on_string_W2_near_M3",
        {
            "c03": "c032fc5ae51bfb4414031b5b613f936789fe465e98eff96e0b035a63f35c48c0",
            "c04": "7588ca31bc611fa117667db046eadfb42c5f75b8cf326306fd1a12f7fbc8d327",
            "m00": "17b89e9c0595ec2f0916c4d9681c177d60bbb3f9fc047cd362c20500605fffcd",
            "m01": "608b823b5cd1067856e7dd3599821baa06a7224c0ac832b5f3a46b7ad716127d",
            "m02": "88ecf47cad9d5902fbaac5bbb519ae3e4aa89ec7545e58bb1615b4d326bc0428",
        },
    ),
    "E8_string_M3_W3": (
        "weight_on_string_W3_near_M3",
        {
            "c00": "0421753cd45004b8462fa9eaa3f5e6a30ed26628821ae13c85600c9fcd06e17c",
            "c01": "22397d5848bfdd69054566c5094907bac80744632965fd264af63b577fcb15f0",
            "c02": "8844708fd5ea03bfde75cd4db5a1803a2ae82451302a30ba46f15fd4dfd21429",
            "m00": "c8edc8815ed25ff1ca3b0d000f44f72300cc437fcafb1e950baa877210226f20",
            "m01": "a5fb3474974578bed3b59681690ca59853ba4c160e035ed04bb33a77c6f69535",
            "m02": "f5b509879ac179137b8a7960ce94738cc08303cb81b6a6c7d531ae7baf66f993",
        },
    ),
    "E8_tape_M3_tape": (
        "tape_on_propeller_M3",
        {
            "c00": "52bb01be1d0fda021da4986bcf8b31018f999c41a69fb0b75f0962a800230674",
            "c01": "03c95d254c01dafb3150933a0f1e590fcf766538cec1f7eb75822a172ee82e33",
            "c02": "beb585fc010a1434170f276cc5f21d23058a7c4dbb456004adf63ac16f8823ab",
            "m00": "63bc197b215bcc3ad555aee0c5c09766b2621fb5cc464b6d587e2bc2f38dc606",
            "m01": "01de2ba3ec7ed21a298858433dc86c7f2a48741b958f40c8ba0afbe0be7abc16",
            "m02": "4b429b85037a493f9c2ea4d8cb08d54220901c240955facfd632c5304fb24bbc",
        },
    ),
    "E8_weight_M3M4_W1": (
        "add_weight_W1_near_M3_M4",
        {
            "c00": "f56991c0688f6049f2370a9f2290710b4f8117b697ed3c4c087e68c43623ea7b",
            "c01": "5a2ee7d4efc9adc3c15ca38fbfe0624ea5406cb60eecc88905a6ccbff5902ea7",
            "c02": "2a0853901f2391f9e3d0fda651797caffaf86f438a2eb99e9ba0ca3c4b85557d",
            "m00": "65237b24794ea862da033c043562956578be333d7adcf7c6c1aad8421690547c",
            "m01": "db979237cbf4e68397f49945cda20e468ee96762cec60446dd2c022d08c48510",
            "m02": "39f06c3be7d1d593c54cba340b5aafd9481204710dee327ddb85f399e3b5ab1f",
        },
    ),
    "E9_cut_M3_1-0.5": (
        "cut_propeller_M3_1mm_0.5mm_45.5mm",
        {
            "c00": "5e002b24f8e6394cf1e4931b439314ebd04cac35aa7d0182886f03ee4a904b01",
            "c01": "c31dda59bc1b332c0dfc42a7e9fd6e3f000ea9aed79ea32a696fd9e1205444c6",
            "c02": "98eb95fd1c0bfd4e6b7008536e4469d6c98c2ef392128262dc72e81496eafc4d",
            "m00": "f47bb1c0eb01f054e0d0d06a6ec3c82828f94f0617b17091ba7a4e4303847c97",
            "m01": "37fc565efad5bc67aa9d5c68925925465021d43559274134148504268cc27d97",
            "m02": "834d18b802144d2d3dba5e25f67f7f3722c3594ae25b4588e4e379c3e98c0491",
        },
    ),
    "E9_cut_M3_1.5-1": (
        "cut_propeller_M3_1.5mm_1mm_44.5mm",
        {
            "c00": "964417b0212a370447c7a16dde00c6855c393db758f00b87b67f4890416be434",
            "c01": "39c5f240e797265e94e947b295aebf507ea01ae887bb1edaa504ac51b74cb087",
            "c02": "e90ae79415d541ee246e5ba02e16b7a4044190170cdbc150aaa47ce681e7f26a",
            "m00": "5cf8a78d327d5a1fadeddf6adaed13c00c3d875bcf50eda5ffc30b773ebc35c7",
            "m01": "565ac8759b49f111a735e8b3c4bbf4078b763a2bcede953b4c36ec59dad0038b",
            "m02": "6b74b2ac99ead09e02f362dbb56b40853a2ba058576d9e54451ac07a33db03b7",
        },
    ),
    "E9_cut_M3_1one": (
        "cut_propeller_M3_1mm",
        {
            "c00": "826c3dd8d95dce5a047df6ffd24a33605642ef8d3251e2c7450846762460b301",
            "c01": "24202450b5e7aacd7891b0ea4a5f2b30171234f270c98142b9b74aff4de8a5e4",
            "c02": "0b8a1fdb9ea926a07f327b5c4ba2a59a4b0b9e8bb8dea067535c2d9f619ee919",
            "m03": "53ccc5d0d4978bbcfce4b1ee48ddaf9fcb8d4075912e02594198677ad1ad2139",
            "m04": "6fd2acbccd9664ac7e2148d18d2649b94f101645277206818ab0e50401fa4999",
            "m05": "8ba9b51c1cb91cafdc4f8468484724b46b24c7c193dc42bc9353dfbb2e0178d2",
        },
    ),
    "E9_cut_M3_2-2": (
        "cut_propeller_M3_2mm_2mm_43mm",
        {
            "c00": "1a9dabf8050b412fe86ecf673fd4c83302fc00ff41d70deb1b5a07d05367c7fd",
            "c01": "8e942ec2510a0529a5f1c5d06b3586489a2af472c078a64af7f16dfcd02ea6d8",
            "c02": "d9ba0ebd7f1b0f79895099890d725a8282d150d734d43f82ad50f020d51c8ee3",
            "m00": "733287ec6cae0dd29add4d6a70eedadf449a9e7f22b6296b444905f13e9cd1e9",
            "m01": "d75374e693e839a7c1adbbd6deadaf46a0d17cb8d3dc63d3a62960636a659f75",
            "m02": "a0019692f571328ca3b644be428c8a619d300db1375fa9a918fbd7adb9f7d8a3",
        },
    ),
    "E9_cut_M3_2-2q": (
        "cut_m3_2mm_2mm",
        {
            "c00": "7e9fd67b1902a4f8ec67c8cb2077fb5613e6be0e831d521aafb433c35450aa40",
            "c01": "13e9a2c3480510121ff41f253c83985e3fac64f1458d7afdaf164e5c4a5a1919",
            "c02": "10900d9edd7cdee5bc42d6d47ef392e9a2c0102aa41fb95e09f270bc18217cad",
            "m00": "7a043f8247329a2813e6f1b8f70a9f6a7298dac88ad103c7a11c551e3c3d72cb",
            "m01": "09a6796f5795789377d77363ae6e5d3ee7c3b3bc62de07b8eda8160b3c843020",
            "m02": "3585653d61fefeb7a196d9f604af743075b847daec4b220c321127a1d085a4f1",
        },
    ),
    "E9_cut_two_M1M2_0.5_0.5": (
        "cut_M2_0.5~_46.5~_M1_0.5~_46.5~",
        {
            "c00": "4841aa43080b7c7df05be517f6526495cf695434c62adfe655d606af232c75ed",
            "c01": "0db8ce275f024c47e0163f3e0eee802b4b27a7ee539496c664304e008b38ef5c",
            "c02": "7718e804369ee6867661f5ce087ebe0ac134c283965f345c3610a50869546e2d",
            "m00": "35e21dd103e502ab79fa84c687ae4aec834c264555b7affcbd17c4d9d2322e9e",
            "m01": "b050da5995381c4779469e8dbd68108886c60bf02a9844ebca1df224e3ec797a",
            "m02": "f3a3d8d3e2f77c8744ea89ffe6064cee0e8d9ddf8822fe5d0e1753d9deca35b6",
        },
    ),
    "E9_cut_two_M1M2_1-0.5_1-0.5": (
        "cut_M2_1~_0.5~_45.5~_M1_1~_0.5~_45.5~",
        {
            "c00": "a2546e51225561a0b6dab2dfde97f8dbd51c58198c1d20a91fd0536116b313cb",
            "c01": "6f8d685171c1054eda68e54566eae85506d2a87168831be42b0aad4fb2293d11",
            "c02": "83cbaa59c6dceea1c6276cfe3f21b625972659fe7e603ea26eb517c7f75b76a6",
            "m03": "2161752c8547f655cac7cecbd77497029cea6dbdeb994a1b00c2d6399524129e",
            "m04": "83ce1d50e4f0ef3c456617b11013024666376edb57dee421985588fb734131cc",
            "m05": "032c975fc3da38c943cd10b7cfeaf6d9aa3bad5ba0fb97b60249b5edd3afca4d",
        },
    ),
    "E9_cut_two_M1M2_1.5-1.5_1.5-1.5": (
        "cut_M2_1.5~_1.5~_44~_M1_1.5~_1.5~_44~",
        {
            "c00": "cb8f76c7ebe4cafbde9ae3ff686dbf9312b3b27f7ba9644a07f468ce92ea09a5",
            "c01": "17fa80ace01b783bd22dd6d44d6e3b7cd449eb49134bd12035f13fcec83112c6",
            "c02": "3d76632038f07e9c0ec3b8320b7f8ca4fd87e4aa8d2b08688f4d2db0a04d356a",
            "m03": "b24ff781d69e81c2d7ddab930cc9d97c041556b0fdae594d0446c14e4aac512b",
            "m04": "4ce33dbde30f481cae9555cf998d66f45c7cbd3e8383ef3d1e1403524b7d8c7e",
            "m05": "20ddc456bd40c4684c31ef3e1a74a88c484350053b68fe3826eab0ad21515bff",
        },
    ),
    "E9_cut_two_M1M2_1.5-1_1-1": (
        "cut_M2_1.5~_1~_44.5~_M1_1~_1~_45~",
        {
            "c03": "7d352ca32bc18cebf360308bbddbb8b1f5b732846faa97c2b033f235410c4187",
            "c04": "c3f64d70c5065cbd7a0d03291c58756d6ebf6a899520903a66ed58bd7ded8d9f",
            "c05": "f43a6c4431d849933770a00e6481fb103c15208ca1caa23e3674b33604f8c4f9",
            "m00": "e8ec94f78f234628b7d72fec481fec822cf1ad026f3c6a52cd610a500a90718d",
            "m01": "4fc8d70eee0ae018aa1f56fd7375c97f174dd2a8247b3286cf09747bed95e9cd",
            "m02": "4757aeceda57bda4658a41b23128d9e2ab6f15b0fd2dfa9169d81c6bbb26423c",
        },
    ),
    "E9_cut_two_M1M2_2-2_2-1.5": (
        "cut_M2_2.0~_2.0~_43~_M1_2.0~_1.5~_43.5~",
        {
            "c03": "b87c6cdb57c8ed74c0bb84c2b6f775c3f8f64041bf3ebadb43b1ea5c5b100e74",
            "c04": "b8f42cc47f6f73687464cb272cb393beba05a1a074760ad5edba51c6333a3de9",
            "c05": "eca11affba3d8bb21340449af6d08da462c66a5f86497f32f09d486b9eadedca",
            "m00": "07bcf951a64906d0ef4e3d8e894e70b1d8d7f55083f7ec8c8b1d5d61117986e4",
            "m01": "f26adf48e1d6cb81da1feb0627f65a0a56c2e537dbb9e5ddbb8346706df4a050",
            "m02": "640db51d04b306acea08cb7604df19075fcf8f1ce5b8abe9473800f32c5edbe2",
        },
    ),
    "E9_cut_two_M1M2_2.5-2_2.5-2": (
        "cut_M2_2.5~_2.0~_42.5~_M1_2.5~_2.0~_42.5~",
        {
            "c01": "3d007268d8de94b45c9b94cb52e9905f55042e652133e0f9158cb968999149b0",
            "c02": "2ecb7f14b88df8d72c08e60ffe1c2860487e1ec216aadda256b2186c3a61048d",
            "c03": "6c44b5454d41b04debbfb3dd8783a064c97b730e63253c36ffaac5bf54fc52f7",
            "m03": "55461c64c360b6c51048b6988389b3c1e1d32972d9eb7d7d9e74ec07d6eeaffc",
            "m04": "fcae8e53fed4cc39f76f43c1aa1f451ccc22852c1e10db35f1e3ca09c8b75ad3",
            "m05": "8e91d8fae8db0d7a78ed287409e36fa7cf4b93fea51b54639c8a40988e389443",
        },
    ),
    "E9_cut_two_M1M2_3-2.5_2.5-2.5": (
        "cut_M2_3.0~_2.5~_41.5~_M1_2.5~_2.5~_42~",
        {
            "c03": "393a42f3ee408f846b4966480a725f063744875b0620a802427d30783ffc9569",
            "c04": "dc67605de20bd60523a9b0954772a9530f59ddd9071d8cddf7c7146cd14f1017",
            "c05": "e483e1b2b3746f588974dd184f444f42928efface89b65e668944ddfe9d7251e",
            "m00": "f5182f8c1aee1746583dd743b8d5ef671abd33322098750bf65ee06c3c79392f",
            "m01": "9a53af09feb0e7019658f7d74b19805cd93e79c1d90049e4a3184d0a581c16fa",
            "m02": "4fb7fec88cd07089aa33bf2397181fcded1bf42992c76533793c2ce888b907fc",
        },
    ),
    "E9_cut_two_M1M2_3-3_3-3": (
        "cut_M2_3.0~_3.0~_41~_M1_3.0~_3.0~_41~",
        {
            "c00": "166657f1969bfc7e7fbc07bdc97080eb95a1a3e91d38c281895916fed0b8f304",
            "c01": "7a018ca50df35f1a42ac409db6446dd638def1b76cb9cacac312a1b861a16e8b",
            "c02": "27e401c655183946af5bb5f801fa4b4e9632291d5a6e953c407cfdd11d8e8752",
            "m03": "30af2fbb9f983a868e62ed10740f41441c789a7778ae66d969e8afba7f63ff08",
            "m04": "74f166ce258569186d53cdf2c01aa2873b064dff91078133f3009da50a22aab2",
            "m05": "6d2834922c8b3f172e5524dbea11cf5212d9b10731352a6638f906da8277d815",
        },
    ),
    "E9_cut_two_M1M2_3.5-3.5_3.5-3.5": (
        "cut_M2_3.5~_3.5~_40~_M1_3.5~_3.5~_40~",
        {
            "c00": "e63f4c2756be9d2edd1367514f858debbee67af52fafdca8aae481a78d77c364",
            "c01": "2e62ae6c4840e55a0fb9263743aac69e8e32f78443bdcc2f651a3d7580a3d9c5",
            "c02": "1728690cac8c0d0c0a1c66042d9017faaf33906acdc9ce8ff3878e9a333a35bf",
            "m03": "46fce0b915e46af084af4307797d844def93eb5a4682abde049d75a9aedc2497",
            "m04": "058a27bdd58e5a9a1605dc347f031dff279eacaa9a192c16eb787df12e568484",
            "m05": "dfee5a702b880f90291add53f50b70fca30a9d08fb265d9196a38babc4271e88",
        },
    ),
    "E9_cut_two_M2_0.5_0": (
        "cut_M2_0.5~_46.5~",
        {
            "c00": "3e07e12b2d10c0de816fc75be7abe40c88804d5649a79fa3c642915e770afd3f",
            "c01": "7eddba53b6174cf09fc9cf9eff6fe6a0cfae1884e91fc4907fa2eb2e70917360",
            "m00": "abd5eae1a782203508cfe393967dba0084e231f384fac052694b37ef069489fc",
            "m01": "2d3330111a8103b1e63a6e49e3f92b45524177d6a1f6d46a0435476e64fabd75",
        },
    ),
    "E9_normal": (
        "normal_flight",
        {
            "c00": "d1c433c9b802513b428edbf7f1b90da8e4bf3764430b5f1fc5c805c24651816f",
            "m00": "2861412dc1b23cafbdbbd8392657bf43760d08ccf46f217ca41c66d31ddf4ba8",
            "m03": "53427015a5518fb8a5f2b86947a151ff369f6bdf07a29d86c1e2a8a5d4e66450",
        },
    ),
    "E9_tape_M1M3_tape": (
        "tape_on_propeller_M1_M3",
        {
            "c00": "1c081a8920e57a080c087d6a30af46ef3ebfc573efebfd9126e31b4a0a72eed6",
            "c01": "511f89dd69a17914eec19a85918afdcccb46121bdf4d3db1184290f20d193d77",
            "c02": "c7af510a19a5cf29498d5cdb374ff9f119e21a02307f00dc226f9b507c19c971",
            "m00": "874a1f86bcc94f524291543a90413a9232a0e9e96e956f1734773bc59a9b18a1",
            "m01": "e44bd1b5bed43411ceae54c3e1a7e2bc33502a0000fb6a51efe174f8c0b9f978",
            "m02": "57c8b2798d22f6095dd794007e84f17e0e9c561d8ae9f9075675f4d40805b854",
        },
    ),
    "E9_weight_M3_W1": (
        "add_weight_W1_near_M3",
        {
            "c00": "6306e0e8826ede165ecf4581605b02f8ad541b1dc9db7eb1d81151010a22ff1a",
            "c01": "54e060ddb6b8f740fd31d5e0434e5ccfcd1113e124fb4ded8b935ae05521e55c",
            "c02": "0d30d610748a3bc197481585c3ad88591ff1d7376c64c64761f1e52082dbed2b",
            "m04": "6e0993e87033c6afed276aeedbf32356a7cefd03139bf54c6aa857ac4efc63cf",
            "m05": "4fd836a5e2a9aec96a1651a02bde291981cbc87a248965d194897e880d9944d5",
            "m06": "ea1a920f2424145b2c383da36cd9437059d7d6cc552c289cf3d687c634ce6b18",
        },
    ),
}
_KIND = {"m": "motor_data", "c": "controller_data"}


def flight_files() -> tuple[DataFile, ...]:
    """Return the flights; the public binary logs have no checksum yet."""
    return tuple(
        DataFile(
            path=f"data/{_KIND[log[0]]}/{_letters(folder)}/{group[:2]}_log{log[1:]}",
            sha256=None,
            offline=f"{group}_{log}.parquet",
            offline_sha256=checksum,
        )
        for group, (folder, logs) in _GROUPS.items()
        for log, checksum in logs.items()
    )


def _letters(folder: str) -> str:
    return folder.replace("~", "\u043c\u043c")
